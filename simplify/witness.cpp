#include "simplify/witness.hpp"

#include <algorithm>

#include "simplify/triangle_distance.hpp"
#include "surface/infinity.hpp"

namespace sidewall::simplify {

Witness farther_witness(const CollapseMesh& mesh, const Vec3& place, std::span<const MovedTriangle> moved,
                        const Vec3& first, const Vec3& second, double enough2) {
    const auto distance2 = [&](const Vec3& p) {
        double best = kInfinity;
        for (std::size_t k = 0; k < moved.size() && !(best <= enough2); ++k)
            best = std::min(best, distance2_to_triangle(place - p, mesh.position(moved[k].u) - p,
                                                        mesh.position(moved[k].w) - p));
        return best;
    };
    const double to_first = distance2(first), to_second = distance2(second);
    return to_second > to_first ? Witness{second, to_second} : Witness{first, to_first};
}

void RecentDistances::add(double distance2) {
    constexpr double kMemory = 1024.0;
    count = std::min(count + 1.0, kMemory);
    mean2 += (distance2 - mean2) / count;
}

double RecentDistances::limit2() const {
    // Few vertices of a rough surface are farther than this; less than the least is rounding.
    constexpr double kOutlier = 2.5, kLeast = 1e-5, kEnough = 200.0;
    return count < kEnough ? kInfinity : std::max(kOutlier * kOutlier * mean2, kLeast * kLeast);
}

}  // namespace sidewall::simplify
