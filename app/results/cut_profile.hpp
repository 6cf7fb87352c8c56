#pragma once
#include <limits>
#include <utility>
#include <vector>

#include "levelset/domain.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The value of a figure that does not exist.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A profile: where a vertical plane cuts a surface or an interface.
struct Profile {
    std::vector<surface::Polyline> lines;
    Vec3 along;                   // horizontal axis in the plane
    std::vector<double> mirrors;  // reflective sides, where a half structure's other half begins
    std::vector<double> shifts;   // along the profile to its repetitions beyond periodic sides
    double middle = 0.0;          // of the domain, along the profile

    template <class Use>
    void each_segment(Use&& use) const {
        for (const auto& line : lines) {
            const std::size_t n = line.points.size();
            for (std::size_t k = 0; k + 1 < n + (line.closed ? 1 : 0); ++k)
                use(line.points[k], line.points[(k + 1) % n]);
        }
    }
};

Profile profile_of(const TriangleMesh& mesh, const surface::Plane& plane, const levelset::Domain& domain);

/// Stretches of a line, ascending and apart; the first may begin at minus infinity, the last end at infinity.
using Stretches = std::vector<std::pair<double, double>>;

/// Stretches of the horizontal line at a height that lie in material, mirrored and periodic copies included.
Stretches solid_at(const Profile& profile, double z);

/// Stretches in z of the vertical line at a place along the profile that lie in material.
Stretches solid_below(const Profile& profile, double along);

/// The difference \p a minus \p b.
Stretches without(const Stretches& a, const Stretches& b);

/// The openings at a height, between two stretches of material.
Stretches openings(const Profile& profile, double z);

/// The widest opening at a height; of equally wide ones, such as a mirrored copy, the one nearest to the domain's middle;
/// NaN, NaN if there is none.
std::pair<double, double> widest_opening(const Profile& profile, double z);

/// Width of the widest opening; NaN if there is none.
double opening(const Profile& profile, double z);

}  // namespace sidewall::app
