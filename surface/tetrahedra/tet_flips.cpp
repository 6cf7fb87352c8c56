#include "surface/tetrahedra/tet_flips.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace sidewall::surface {
namespace {

constexpr std::size_t kMost = 7;  // vertices around an edge
constexpr double kGain = 1e-6;    // of a cosine: less is no improvement

/// The vertices around an edge in order, so that (a, b, ring[i], ring[i + 1]) are its tetrahedra; empty unless they
/// close a ring.
std::vector<std::uint32_t> ring_of(const TetComplex& mesh, std::uint32_t a, std::uint32_t b,
                                   const std::vector<std::uint32_t>& tets) {
    std::vector<std::array<std::uint32_t, 2>> pairs;
    for (const std::uint32_t t : tets) {
        std::array<std::uint32_t, 2> rest{};
        std::size_t n = 0;
        for (const std::uint32_t v : mesh.tet[t])
            if (v != a && v != b) rest[n++] = v;
        if (mesh.volume({a, b, rest[0], rest[1]}) < 0.0) std::swap(rest[0], rest[1]);
        pairs.push_back(rest);
    }
    std::vector<std::uint32_t> ring{pairs[0][0]};
    std::uint32_t next = pairs[0][1];
    while (next != ring[0]) {
        if (ring.size() >= pairs.size()) return {};
        ring.push_back(next);
        const auto found =
            std::find_if(pairs.begin(), pairs.end(), [&](const auto& p) { return p[0] == next; });
        if (found == pairs.end()) return {};
        next = (*found)[1];
    }
    if (ring.size() != pairs.size()) ring.clear();
    return ring;
}

bool same_region(const TetComplex& mesh, const std::vector<std::uint32_t>& tets) {
    return std::all_of(tets.begin(), tets.end(),
                       [&](std::uint32_t t) { return mesh.region[t] == mesh.region[tets[0]]; });
}

}  // namespace

bool remove_edge(TetComplex& mesh, std::uint32_t a, std::uint32_t b) {
    const std::vector<std::uint32_t> old = mesh.at_edge(a, b);
    if (old.size() < 3 || old.size() > kMost || !same_region(mesh, old)) return false;
    const std::vector<std::uint32_t> ring = ring_of(mesh, a, b, old);
    if (ring.empty()) return false;
    double before = -1.0;
    for (const std::uint32_t t : old) before = std::max(before, mesh.cosine(t));
    // The best triangulation of the ring between i and j (Klincsek, 1980), each triangle with a and with b.
    const std::size_t n = ring.size();
    std::array<std::array<double, kMost>, kMost> widest{};
    std::array<std::array<std::size_t, kMost>, kMost> apex{};
    for (std::size_t span = 2; span < n; ++span)
        for (std::size_t i = 0; i + span < n; ++i) {
            const std::size_t j = i + span;
            widest[i][j] = std::numeric_limits<double>::infinity();
            for (std::size_t k = i + 1; k < j; ++k) {
                double here = std::max(k > i + 1 ? widest[i][k] : -1.0, j > k + 1 ? widest[k][j] : -1.0);
                here = std::max(here, mesh.cosine({ring[i], ring[k], ring[j], b}));
                here = std::max(here, mesh.cosine({ring[i], ring[j], ring[k], a}));
                if (here >= widest[i][j]) continue;
                widest[i][j] = here;
                apex[i][j] = k;
            }
        }
    if (widest[0][n - 1] >= before - kGain) return false;
    std::vector<Tetrahedron> by;
    std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
    while (!open.empty()) {
        const auto [i, j] = open.back();
        open.pop_back();
        if (j - i < 2) continue;
        const std::size_t k = apex[i][j];
        by.push_back({ring[i], ring[k], ring[j], b});
        by.push_back({ring[i], ring[j], ring[k], a});
        open.push_back({i, k});
        open.push_back({k, j});
    }
    // An edge that is there already, elsewhere, would be there twice.
    for (const Tetrahedron& t : by)
        for (const auto& [p, q] : {std::array{t[0], t[1]}, {t[1], t[2]}, {t[0], t[2]}}) {
            const auto at_p = std::find(ring.begin(), ring.end(), p) - ring.begin(),
                       at_q = std::find(ring.begin(), ring.end(), q) - ring.begin();
            const auto apart = static_cast<std::size_t>(std::abs(at_p - at_q));
            if (apart != 1 && apart != n - 1 && !mesh.at_edge(p, q).empty()) return false;
        }
    mesh.replace(old, by, mesh.region[old[0]]);
    return true;
}

bool remove_face(TetComplex& mesh, std::uint32_t t, std::uint32_t corner) {
    std::array<std::uint32_t, 3> face{};
    std::size_t n = 0;
    const Tetrahedron c = mesh.tet[t];
    for (const std::uint32_t v : c)
        if (v != corner) face[n++] = v;
    if (mesh.volume({face[0], face[1], face[2], corner}) < 0.0) std::swap(face[1], face[2]);
    for (const std::uint32_t other : mesh.at_edge(face[0], face[1])) {
        if (other == t || !mesh.has(other, face[2]) || mesh.region[other] != mesh.region[t]) continue;
        std::uint32_t far = 0;
        for (const std::uint32_t v : mesh.tet[other])
            if (v != face[0] && v != face[1] && v != face[2]) far = v;
        if (!mesh.at_edge(corner, far).empty()) return false;
        const double before = std::max(mesh.cosine(t), mesh.cosine(other));
        std::array<Tetrahedron, 3> by{};
        for (std::size_t k = 0; k < 3; ++k) {
            by[k] = {face[k], face[(k + 1) % 3], far, corner};
            // The edge must pass through the face: else one of the three lies the other way round.
            if (!(mesh.volume(by[k]) > 0.0) || mesh.cosine(by[k]) >= before - kGain) return false;
        }
        const std::array<std::uint32_t, 2> old{t, other};
        mesh.replace(old, by, mesh.region[t]);
        return true;
    }
    return false;
}

}  // namespace sidewall::surface
