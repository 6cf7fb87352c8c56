#include "flux/radiosity/profile_outline.hpp"

#include <map>
#include <utility>

namespace sidewall::flux {
namespace {

// Orders segments so that each begins where the one before it ends: views merge such runs at once.
std::vector<Segment> along_lines(const std::vector<Segment>& segments, std::size_t points) {
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> beginning(points, kNone);
    std::vector<char> is_end(points, 0), taken(segments.size(), 0);
    for (std::uint32_t i = 0; i < segments.size(); ++i) {
        beginning[segments[i].end[0]] = i;
        is_end[segments[i].end[1]] = 1;
    }
    std::vector<Segment> ordered;
    for (const bool closed : {false, true})
        for (std::uint32_t i = 0; i < segments.size(); ++i)
            for (std::uint32_t k = closed || !is_end[segments[i].end[0]] ? i : kNone; k != kNone && !taken[k];
                 k = beginning[segments[k].end[1]]) {
                taken[k] = 1;
                ordered.push_back(segments[k]);
            }
    return ordered;
}

}  // namespace

Outline outline_of(const TriangleMesh& mesh, const ProfileUnknowns& profile) {
    Outline outline;
    std::map<std::pair<double, double>, std::uint32_t> places;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        if (t > profile.partner[t]) continue;
        const auto place = [&](std::uint32_t k) {
            const Vec3& v = mesh.vertices[mesh.triangles[t][k % 3]];
            const auto [at, is_new] =
                places.try_emplace({v.x(), v.z()}, static_cast<std::uint32_t>(outline.points.size()));
            if (is_new) outline.points.push_back({v.x(), v.z()});
            return at->second;
        };
        // The corner that is not on the triangle's edge along y.
        const std::uint32_t alone = place(0) == place(1) ? 2 : place(1) == place(2) ? 0 : 1;
        const double area = triangle_area(mesh, t) + triangle_area(mesh, profile.partner[t]);
        if (!(area > 0.0)) continue;
        const Vec3 normal = area_vector(mesh, t).normalized();
        Segment one{{place(alone + 1), place(alone)}, {}, {normal.x(), normal.z()}, area, t};
        for (std::uint32_t k = 0; k < 2; ++k)
            one.unknown[k] = profile.unknowns.corner[3 * t + (alone + 1 - k) % 3];
        if (cross(outline.points[one.end[1]] - outline.points[one.end[0]], one.normal) < 0.0) {
            std::swap(one.end[0], one.end[1]);
            std::swap(one.unknown[0], one.unknown[1]);
        }
        outline.segments.push_back(one);
    }
    outline.segments = along_lines(outline.segments, outline.points.size());
    return outline;
}

}  // namespace sidewall::flux
