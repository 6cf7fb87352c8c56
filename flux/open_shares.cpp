#include "flux/open_shares.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "flux/tracer/flight.hpp"

namespace sidewall::flux {
namespace {

// A point a skin off the surface from which rays test the visibility of the source, with its triangle's
// normal and the area that it represents.
struct VisibilityProbe {
    Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
    double area = 0.0;
};

// The probe near corner \p k of triangle \p t, moved from it towards the centroid by the share \p inside.
VisibilityProbe probe_at(const TriangleMesh& mesh, const LateralBox& box, double skin, std::size_t t,
                         std::size_t k, double inside) {
    const Vec3 twice = area_vector(mesh, t), normal = twice.normalized();
    VisibilityProbe out{(1.0 - inside) * mesh.vertices[mesh.triangles[t][k]] +
                            inside * triangle_centroid(mesh, t) + skin * normal,
                        normal, 0.5 * twice.norm()};
    for (std::size_t axis = 0; axis < 2; ++axis)
        if (box.boundary[axis] != Boundary::open) {
            double& x = out.point[static_cast<Eigen::Index>(axis)];
            x = std::clamp(x, box.min[axis], box.max[axis]);
        }
    if (box.axial) out.point.y() = 0.0;
    return out;
}

// Adds the probe of the wedge at corner \p c, at the centroid of the wedge's hat function: 3/4 of the
// distance to the triangle's centroid, or, on a surface of revolution, 1/3 of the segment's length.
void add_probe(const TriangleMesh& mesh, const Wedges& wedges, const LateralBox& box, double skin,
               std::size_t c, std::vector<VisibilityProbe>& own) {
    constexpr double kMiddle = 0.75, kThird = 0.5;
    const std::size_t t = c / 3, k = c % 3;
    if (!box.axial) {
        own.push_back(probe_at(mesh, box, skin, t, k, kMiddle));
        return;
    }
    // A segment has two triangles: take the one whose other two corners lie on the other ring.
    const std::uint32_t* const ring = &wedges.corner[3 * t];
    if (ring[(k + 1) % 3] == ring[k] || ring[(k + 2) % 3] == ring[k]) return;
    own.push_back(probe_at(mesh, box, skin, t, k, kThird));
    const Vec3& end = mesh.vertices[mesh.triangles[t][k]];
    own.back().area =
        own.back().point.x() * std::hypot(own.back().point.x() - end.x(), own.back().point.z() - end.z());
}

// One probe for every wedge: near the vertex, in the largest triangle of its fan.
std::vector<std::vector<VisibilityProbe>> probes_near(const TriangleMesh& mesh, const Wedges& wedges,
                                                      const LateralBox& box, double skin) {
    constexpr double kNearVertex = 0.2;
    std::vector<std::vector<VisibilityProbe>> places(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        std::vector<VisibilityProbe>& own = places[wedges.corner[c]];
        if (own.empty() || triangle_area(mesh, c / 3) > own[0].area)
            own = {probe_at(mesh, box, skin, c / 3, c % 3, kNearVertex)};
    }
    return places;
}

// Flags the wedges in the penumbra: at a corner of a triangle whose corners' shares differ.
std::vector<std::uint8_t> in_half_shadow(const Wedges& wedges, std::span<const double> open) {
    constexpr double kDiffers = 0.01;
    std::vector<std::uint8_t> half(wedges.count(), 0);
    for (std::size_t t = 0; 3 * t < wedges.corner.size(); ++t) {
        const std::uint32_t* const corner = &wedges.corner[3 * t];
        const auto [least, most] = std::minmax({open[corner[0]], open[corner[1]], open[corner[2]]});
        for (std::size_t k = 0; most - least > kDiffers && k < 3; ++k) half[corner[k]] = 1;
    }
    return half;
}

}  // namespace

std::vector<std::vector<double>> open_shares(const DirectFlux& direct, const TriangleMesh& mesh,
                                             const surface::RayScene& scene, const LateralBox& box,
                                             const Wedges& wedges, bool coarse) {
    const Geometry geometry = make_geometry(mesh, scene, box);
    const double skin = 2.0 * kOverlap * geometry.skin;
    // A single point misses how the share varies within a triangle: on the floor of a round contact whose
    // penumbra is one cell (dx) wide, it loses 1 % of the source.
    const bool whole_fans = coarse || box.axial;
    const auto in_fans = [&](std::span<const std::uint8_t> chosen) {
        std::vector<std::vector<VisibilityProbe>> places(wedges.count());
        for (std::size_t c = 0; c < wedges.corner.size(); ++c)
            if (const std::uint32_t w = wedges.corner[c]; chosen.empty() || chosen[w] != 0)
                add_probe(mesh, wedges, box, skin, c, places[w]);
        return places;
    };
    const std::vector<std::vector<VisibilityProbe>> from =
        whole_fans ? in_fans({}) : probes_near(mesh, wedges, box, skin);
    const std::size_t tallies = direct.tallies();
    std::vector<std::vector<double>> open(direct.beams() * tallies, std::vector<double>(wedges.count(), 0.0));
    for (std::size_t b = 0; b < direct.beams(); ++b) {
        std::vector<DirectFlux::Direction> towards = direct.towards(b, box.axial           ? 4
                                                                       : geometry.straight ? 2
                                                                                           : 1);
        // Sums by tally what would arrive at a probe if nothing were hidden, and what does arrive.
        const auto add_arrivals = [&](const VisibilityProbe& probe, std::span<double> unhidden,
                                      std::span<double> arrives) {
            std::array<Vec3, surface::RayPacket::kRays> paths;
            std::array<std::size_t, surface::RayPacket::kRays> which;
            constexpr std::size_t kEnough = 16;
            for (std::size_t next = 0; next < towards.size();) {
                std::size_t count = 0;
                for (; next < towards.size() && count < paths.size(); ++next) {
                    paths[count] = towards[next].towards;
                    if (geometry.straight) paths[count].y() = 0.0;
                    which[count] = next;
                    if (paths[count].dot(probe.normal) > 0.0) ++count;
                }
                const std::uint32_t seen = sees_source(geometry, probe.point, std::span(paths).first(count));
                for (std::size_t k = 0; k < count; ++k) {
                    const double cosine = std::min(1.0, towards[which[k]].towards.dot(probe.normal));
                    const double weight =
                        towards[which[k]].weight * cosine / std::max(DirectFlux::kMinRise, paths[k].z());
                    for (std::size_t tally = 0; tally < tallies; ++tally) {
                        const double brought = weight * direct.brings(tally, towards[which[k]], cosine);
                        unhidden[tally] += brought;
                        if ((seen >> k & 1u) != 0) arrives[tally] += brought;
                    }
                }
                // Most probes see the whole beam or none of it; 16 directions spread over it settle that.
                if (next >= kEnough && (arrives[0] == 0.0 || arrives[0] == unhidden[0])) break;
            }
        };
        const auto set_shares = [&](const std::vector<std::vector<VisibilityProbe>>& places) {
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, wedges.count(), 64), [&](const auto& range) {
                std::vector<double> unhidden(tallies), arrives(tallies), sum(tallies);
                for (std::size_t w = range.begin(); w != range.end(); ++w) {
                    double area = 0.0;
                    std::ranges::fill(sum, 0.0);
                    for (const VisibilityProbe& probe : places[w]) {
                        std::ranges::fill(unhidden, 0.0);
                        std::ranges::fill(arrives, 0.0);
                        add_arrivals(probe, unhidden, arrives);
                        area += probe.area;
                        for (std::size_t k = 0; k < tallies; ++k) {
                            const std::size_t of =
                                unhidden[k] > 0.0 ? k : 0;  // of arrivals, if the yield is 0
                            if (unhidden[of] > 0.0) sum[k] += probe.area * arrives[of] / unhidden[of];
                        }
                    }
                    for (std::size_t k = 0; area > 0.0 && k < tallies; ++k)
                        open[b * tallies + k][w] = sum[k] / area;
                }
            });
        };
        set_shares(from);
        if (!whole_fans) set_shares(in_fans(in_half_shadow(wedges, open[b * tallies])));
    }
    return open;
}

}  // namespace sidewall::flux
