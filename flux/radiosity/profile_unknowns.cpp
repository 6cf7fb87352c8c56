#include "flux/radiosity/profile_unknowns.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

//     A1 ----- B1     y = max     One facet: A0 and A1 are one point of the profile, and so are B0 and B1.
//      | \     |                  Each triangle has one of the edges along y. The two share the diagonal.
//      |   \   |
//     A0 ----- B0     y = min

bool along_y(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) {
    const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
    return p.x() == q.x() && p.z() == q.z() && p.y() != q.y();
}

// The partner of each triangle, across its diagonal; nothing if a triangle has none.
std::optional<std::vector<std::uint32_t>> partners(const TriangleMesh& mesh) {
    constexpr std::uint32_t kAlone = 0xffffffffu;
    std::vector<std::uint32_t> partner(mesh.triangles.size(), kAlone);
    const surface::EdgeTable table = surface::edge_table(mesh);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto [a, b] = table.edges[e];
        const auto corners = table.corners[e];
        if (corners.size() != 2 || mesh.vertices[a].y() == mesh.vertices[b].y() || along_y(mesh, a, b))
            continue;
        partner[corners[0] / 3] = corners[1] / 3;
        partner[corners[1] / 3] = corners[0] / 3;
    }
    if (std::ranges::find(partner, kAlone) != partner.end()) return std::nullopt;
    return partner;
}

// By wedge, the lowest one at the same point of the profile; nothing if a triangle has no edge along y.
std::optional<std::vector<std::uint32_t>> lowest_twins(const TriangleMesh& mesh, const Wedges& wedges) {
    surface::DisjointSets sets(wedges.count());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        bool any = false;
        for (std::size_t k = 0; k < 3 && !any; ++k) {
            const std::size_t next = (k + 1) % 3;
            any = along_y(mesh, mesh.triangles[t][k], mesh.triangles[t][next]);
            if (any) sets.join(wedges.corner[3 * t + k], wedges.corner[3 * t + next]);
        }
        if (!any) return std::nullopt;
    }
    std::vector<std::uint32_t> lowest(wedges.count());
    for (std::uint32_t w = 0; w < lowest.size(); ++w) lowest[w] = sets.root(w);
    return lowest;
}

// Whether partners have the same unknowns at their corners; partners of different materials have not.
bool agree(const Wedges& wedges, const std::vector<std::uint32_t>& lowest,
           const std::vector<std::uint32_t>& partner) {
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        const std::uint32_t* others = &wedges.corner[3 * std::size_t{partner[c / 3]}];
        if (std::none_of(others, others + 3,
                         [&](std::uint32_t other) { return lowest[other] == lowest[wedges.corner[c]]; }))
            return false;
    }
    return true;
}

}  // namespace

ProfileUnknowns make_profile_unknowns(const Geometry& geometry, const Wedges& wedges) {
    ProfileUnknowns profile;
    profile.unknown.resize(wedges.count());
    std::iota(profile.unknown.begin(), profile.unknown.end(), 0u);
    if (geometry.straight) {
        auto lowest = lowest_twins(geometry.mesh, wedges);
        auto partner = partners(geometry.mesh);
        if (lowest && partner && agree(wedges, *lowest, *partner)) {
            std::uint32_t count = 0;
            for (std::uint32_t w = 0; w < lowest->size(); ++w)
                profile.unknown[w] = (*lowest)[w] == w ? count++ : profile.unknown[(*lowest)[w]];
            profile.partner = std::move(*partner);
        }
    }
    if (geometry.revolution) {  // rings are joined already: odd twins take the unknowns of the even ones
        std::uint32_t count = 0;
        for (std::uint32_t v = 0; v + 1 < wedges.first.size(); ++v)
            for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w)
                profile.unknown[w] =
                    v % 2 == 0 ? count++ : profile.unknown[w - wedges.first[v] + wedges.first[v - 1]];
        for (std::uint32_t t = 0; t < geometry.mesh.triangles.size(); ++t) profile.partner.push_back(t ^ 1u);
    }
    std::uint32_t unknowns = 0;
    for (const std::uint32_t u : profile.unknown) unknowns = std::max(unknowns, u + 1);
    profile.unknowns.area.assign(unknowns, 0.0);
    for (std::size_t w = 0; w < profile.unknown.size(); ++w)
        profile.unknowns.area[profile.unknown[w]] += wedges.area[w];
    for (const std::uint32_t w : wedges.corner) profile.unknowns.corner.push_back(profile.unknown[w]);
    return profile;
}

}  // namespace sidewall::flux
