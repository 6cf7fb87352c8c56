#include "surface/tetrahedra/tetrahedralize.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_cut.hpp"
#include "surface/tetrahedra/tet_improve.hpp"
#include "surface/tetrahedra/tet_lattice.hpp"

namespace sidewall::surface {
namespace {

// Cosine of 8 degrees: no vertex moves where that leaves a smaller angle, unless one was smaller before.
constexpr double kLeastAngle = 0.9902681;
constexpr double kVolumeHolds = 1e-4;  // largest error of a material's volume, relative
constexpr int kMostOffsets = 20;
// Largest moves over TetOptions::shift; above 1 for scraps: few of their vertices are off contact lines.
constexpr double kReaches[] = {1.0, 2.0, 4.0};

constexpr int kNoPair = -1, kSeveralPairs = -2;

/// A face between two materials, its normal out of the lower one; an outside that is not meshed is highest.
struct Facet {
    Triangle corners;
    int low, high;
};

std::vector<Facet> facets_of(const TetComplex& mesh, const std::vector<int>& material, int unmeshed) {
    const std::vector<TetFace> faces = sorted_faces(mesh.tet, [&](std::uint32_t t) {
        return mesh.alive(t) ? material[static_cast<std::size_t>(mesh.region[t])] : -1;
    });
    std::vector<Facet> facets;
    for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
        const bool shared = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted;
        j = i + (shared ? 2 : 1);
        const auto& [a, b, c] = faces[i].corners;
        if (shared ? faces[i].region == faces[i + 1].region
                   : (mesh.side[a] & mesh.side[b] & mesh.side[c]) != 0)
            continue;
        facets.push_back({faces[i].corners, faces[i].region, shared ? faces[i + 1].region : unmeshed});
    }
    return facets;
}

class VolumeMatcher {
  public:
    VolumeMatcher(TetComplex& mesh, const TetOptions& options)
        : mesh_(mesh),
          options_(options),
          unmeshed_(static_cast<int>(options.volume.size())),
          fixed_(options.outside ? largest(options.volume) : options.volume.size()),
          facets_(facets_of(mesh, options.material, unmeshed_)),
          between_(mesh.point.size(), {kNoPair, kNoPair}),
          moved_(mesh.point.size(), 0.0) {
        for (const Facet& facet : facets_)
            for (const std::uint32_t v : facet.corners) {
                auto& pair = between_[v];
                if (pair[0] == kNoPair)
                    pair = {facet.low, facet.high};
                else if (pair != std::array{facet.low, facet.high})
                    pair = {kSeveralPairs, kSeveralPairs};  // contact lines are not moved
            }
    }
    void run() {
        for (const double reach : kReaches) {
            if (hold()) return;
            most_ = reach * options_.shift;
            start();
            for (int round = 0; round < kMostOffsets && move_all() && !hold(); ++round) {
            }
        }
    }

  private:
    static std::size_t largest(const std::vector<double>& volumes) {
        return static_cast<std::size_t>(std::max_element(volumes.begin(), volumes.end()) - volumes.begin());
    }
    bool hold();
    bool lacks(int material) const;
    bool is_lacking_scrap(int material) const;
    void start();
    std::vector<Vec3> pushes() const;
    std::vector<double> offsets(const std::vector<Vec3>& push) const;
    bool move_all();
    double move(std::uint32_t v, const Vec3& way, double by);

    TetComplex& mesh_;
    const TetOptions& options_;
    const int unmeshed_;
    const std::size_t fixed_;  // the material, or the outside, that gives what the others gain
    const std::vector<Facet> facets_;
    std::vector<std::array<int, 2>> between_;  // by vertex: the two materials that meet there
    std::vector<double> moved_;                // by vertex: distance moved so far
    double most_ = 0.0;                        // largest distance of any vertex from its start
    std::vector<std::uint32_t> moving_;        // vertices that may still move
    std::vector<double> lacking_;              // by material: volume still missing
};

// Updates lacking_; returns whether every material has its volume.
bool VolumeMatcher::hold() {
    lacking_ = options_.volume;
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t) {
        if (!mesh_.alive(t)) continue;
        const auto region = static_cast<std::size_t>(mesh_.region[t]);
        lacking_[static_cast<std::size_t>(options_.material[region])] -= mesh_.volume(mesh_.tet[t]);
    }
    for (int m = 0; m < unmeshed_; ++m)
        if (lacks(m)) return false;
    return true;
}

bool VolumeMatcher::lacks(int material) const {
    const auto m = static_cast<std::size_t>(material);
    return m < lacking_.size() && std::abs(lacking_[m]) > kVolumeHolds * std::abs(options_.volume[m]);
}

bool VolumeMatcher::is_lacking_scrap(int material) const {
    return lacks(material) && std::abs(options_.volume[static_cast<std::size_t>(material)]) <= options_.scrap;
}

// Chooses the vertices that may move: all at the first limit, then those of scraps that still lack volume.
void VolumeMatcher::start() {
    moving_.clear();
    for (std::uint32_t v = 0; v < between_.size(); ++v) {
        const auto& [low, high] = between_[v];
        if (low >= 0 && (most_ == options_.shift || is_lacking_scrap(low) || is_lacking_scrap(high)))
            moving_.push_back(v);
    }
}

// Per vertex: volume gained by the lower material per length moved along each axis; 0 across sides.
std::vector<Vec3> VolumeMatcher::pushes() const {
    std::vector<Vec3> push(mesh_.point.size(), Vec3::Zero());
    for (const Facet& facet : facets_) {
        const auto& [a, b, c] = facet.corners;
        const Vec3 area = (mesh_.point[b] - mesh_.point[a]).cross(mesh_.point[c] - mesh_.point[a]) / 6.0;
        for (const std::uint32_t v : facet.corners) push[v] += area;
    }
    for (std::uint32_t v = 0; v < push.size(); ++v)
        for (int axis = 0; axis < 3; ++axis)
            if ((mesh_.side[v] >> (2 * axis) & 3u) != 0) push[v][axis] = 0.0;
    return push;
}

// Potential per material; an interface is offset by the difference of its materials' potentials. These are
// the Lagrange multipliers of the volumes: the offsets have the least sum of area times offset squared.
std::vector<double> VolumeMatcher::offsets(const std::vector<Vec3>& push) const {
    const auto n = std::ssize(lacking_), fixed = static_cast<std::ptrdiff_t>(fixed_);
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n, n);
    for (const std::uint32_t v : moving_) {
        const auto [low, high] = between_[v];
        const double area = push[v].norm();
        if (low != fixed) system(low, low) += area;
        if (high < n && high != fixed) system(high, high) += area;
        if (high >= n || low == fixed || high == fixed) continue;
        system(low, high) -= area;
        system(high, low) -= area;
    }
    // A material without vertices that may move has an empty row: its potential is 0.
    const Eigen::VectorXd potential =
        system.completeOrthogonalDecomposition().solve(Eigen::VectorXd::Map(lacking_.data(), n));
    std::vector<double> result(potential.begin(), potential.end());
    result.push_back(0.0);
    return result;
}

// Moves a vertex along \p way by \p by, within its limit, or half of that; returns how far. 0 if box or
// angles forbid both.
double VolumeMatcher::move(std::uint32_t v, const Vec3& way, double by) {
    by = std::clamp(by, -most_ - moved_[v], most_ - moved_[v]);
    const Vec3 old = mesh_.point[v];
    const double before = mesh_.cosine_around(v);
    for (const double share : {1.0, 0.5}) {
        const Vec3 p = old + share * by * way;
        if ((p.array() < options_.box.min.array()).any() || (p.array() > options_.box.max.array()).any())
            continue;
        mesh_.point[v] = p;
        if (mesh_.cosine_around(v) <= std::max(before, kLeastAngle)) {
            moved_[v] += share * by;
            return share * by;
        }
    }
    mesh_.point[v] = old;
    return 0.0;
}

bool VolumeMatcher::move_all() {
    const std::vector<Vec3> push = pushes();
    std::erase_if(moving_, [&](std::uint32_t v) { return !(push[v].norm() > 0.0); });
    const std::vector<double> offset = offsets(push);
    double farthest = 0.0;
    std::erase_if(moving_, [&](std::uint32_t v) {
        const auto low = static_cast<std::size_t>(between_[v][0]),
                   high = static_cast<std::size_t>(between_[v][1]);
        const double by = offset[low] - offset[high];
        if (by == 0.0) return false;
        const double moved = move(v, push[v].normalized(), by);
        farthest = std::max(farthest, std::abs(moved));
        return moved == 0.0;
    });
    return farthest > 1e-6 * options_.shift;
}

// Moves vertices between two materials along their normals until every material has the volume asked for, by
// at most TetOptions::shift (scraps: four times that) and where no angle falls below 8 degrees.
void match_volumes(TetComplex& mesh, const TetOptions& options) {
    VolumeMatcher(mesh, options).run();
}

/// The tetrahedra that were not removed and their vertices, in order.
TetMesh compact(const TetComplex& mesh, std::size_t regions) {
    TetMesh result;
    std::vector<std::uint32_t> number(mesh.point.size(), TetComplex::kNone);
    for (std::uint32_t t = 0; t < mesh.tet.size(); ++t) {
        if (!mesh.alive(t)) continue;
        Tetrahedron corners = mesh.tet[t];
        for (std::uint32_t& v : corners) {
            if (number[v] == TetComplex::kNone) {
                number[v] = static_cast<std::uint32_t>(result.vertices.size());
                result.vertices.push_back(mesh.point[v]);
            }
            v = number[v];
        }
        result.tetrahedra.push_back(corners);
        result.region.push_back(mesh.region[t]);
    }
    result.regions.resize(regions);
    return result;
}

}  // namespace

TetMesh tetrahedralize(std::span<const Front> fronts, const TetOptions& options) {
    TetComplex mesh = bisected_box(fronts, options);
    const int outside = mesh.outside;
    const auto progress = [&](int fronts_done) {
        constexpr double kLattice = 0.2;
        if (options.progress) options.progress(kLattice + (1.0 - kLattice) * fronts_done / outside);
    };
    progress(0);
    for (int k = outside - 1; k >= 0; --k) {
        cut_front(mesh, fronts, k, options);
        if (k + 1 == outside && !options.outside)
            for (std::uint32_t t = 0; t < mesh.tet.size(); ++t)
                if (mesh.alive(t) && mesh.region[t] == outside) mesh.remove_tet(t);
        improve(mesh, fronts, options);  // good angles help the next cut
        progress(outside - k);
    }
    if (!options.volume.empty()) match_volumes(mesh, options);
    return compact(mesh, fronts.size() + (options.outside ? 1 : 0));
}

}  // namespace sidewall::surface
