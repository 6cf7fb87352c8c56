#include "surface/tetrahedra/tet_complex.hpp"

#include <algorithm>
#include <bit>

namespace sidewall::surface {
namespace {

void insert_region(std::vector<int>& regions, int region) {
    const auto at = std::lower_bound(regions.begin(), regions.end(), region);
    if (at == regions.end() || *at != region) regions.insert(at, region);
}

}  // namespace

int Place::freedom() const {
    return std::max(0, 4 - std::popcount(sides) - static_cast<int>(regions.size()));
}

std::uint32_t TetComplex::add_vertex(const Vec3& p, std::uint8_t sides) {
    point.push_back(p);
    side.push_back(sides);
    around.emplace_back();
    return static_cast<std::uint32_t>(point.size() - 1);
}

std::uint32_t TetComplex::add_tet(const Tetrahedron& t, int of) {
    const auto index = static_cast<std::uint32_t>(tet.size());
    tet.push_back(t);
    region.push_back(of);
    for (const std::uint32_t v : t) around[v].push_back(index);
    ++living_;
    return index;
}

void TetComplex::remove_tet(std::uint32_t t) {
    for (const std::uint32_t v : tet[t]) {
        auto& list = around[v];
        list.erase(std::find(list.begin(), list.end(), t));
    }
    tet[t][0] = kNone;
    --living_;
}

std::vector<std::uint32_t> TetComplex::at_edge(std::uint32_t a, std::uint32_t b) const {
    const bool fewer = around[a].size() <= around[b].size();
    std::vector<std::uint32_t> found;
    for (const std::uint32_t t : around[fewer ? a : b])
        if (has(t, fewer ? b : a)) found.push_back(t);
    return found;
}

double TetComplex::cosine_if_moved(std::uint32_t t, std::uint32_t corner, const Vec3& p) const {
    std::array<Vec3, 4> q;
    for (std::size_t k = 0; k < 4; ++k) q[k] = tet[t][k] == corner ? p : point[tet[t][k]];
    return smallest_dihedral_cosine(q[0], q[1], q[2], q[3]);
}

double TetComplex::cosine_around(std::uint32_t v) const {
    double widest = -1.0;
    for (const std::uint32_t t : around[v]) widest = std::max(widest, cosine(t));
    return widest;
}

// Adds `outside` if a face has one tetrahedron only but is on no side: beyond it nothing is meshed.
void TetComplex::add_outside(Place& place, std::vector<std::array<std::uint32_t, 3>>& faces) const {
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
        for (j = i; j < faces.size() && faces[j] == faces[i]; ++j) {
        }
        if (j - i == 1 && (side[faces[i][0]] & side[faces[i][1]] & side[faces[i][2]]) == 0)
            insert_region(place.regions, outside);
    }
}

Place TetComplex::place(std::uint32_t v) const {
    Place place{side[v], {}};
    std::vector<std::array<std::uint32_t, 3>> faces;
    faces.reserve(3 * around[v].size());
    for (const std::uint32_t t : around[v]) {
        insert_region(place.regions, region[t]);
        Tetrahedron sorted = tet[t];
        std::sort(sorted.begin(), sorted.end());
        for (std::size_t k = 0; k < 4; ++k) {
            if (sorted[k] == v) continue;
            std::array<std::uint32_t, 3> face{};
            std::size_t n = 0;
            for (std::size_t i = 0; i < 4; ++i)
                if (i != k) face[n++] = sorted[i];
            faces.push_back(face);
        }
    }
    add_outside(place, faces);
    return place;
}

Place TetComplex::place(std::uint32_t a, std::uint32_t b) const {
    Place place{static_cast<std::uint8_t>(side[a] & side[b]), {}};
    std::vector<std::array<std::uint32_t, 3>> faces;
    for (const std::uint32_t t : at_edge(a, b)) {
        insert_region(place.regions, region[t]);
        for (const std::uint32_t c : tet[t])
            if (c != a && c != b) faces.push_back({a, b, c});
    }
    add_outside(place, faces);
    return place;
}

std::uint32_t TetComplex::split(std::uint32_t a, std::uint32_t b, const Vec3& p) {
    const std::vector<std::uint32_t> old = at_edge(a, b);
    const std::uint32_t m = add_vertex(p, side[a] & side[b]);
    for (const std::uint32_t t : old) {
        Tetrahedron low = tet[t], high = tet[t];
        std::replace(low.begin(), low.end(), b, m);
        std::replace(high.begin(), high.end(), a, m);
        const int of = region[t];
        remove_tet(t);
        add_tet(low, of);
        add_tet(high, of);
    }
    return m;
}

bool TetComplex::may_collapse(std::uint32_t from, std::uint32_t to) const {
    const Place of_edge = place(from, to);
    if (of_edge != place(from)) return false;
    // Link condition: a vertex next to both ends must be in a tetrahedron at the edge, or the merge pinches.
    const auto others = [&](const std::vector<std::uint32_t>& tets) {
        std::vector<std::uint32_t> list;
        for (const std::uint32_t t : tets)
            for (const std::uint32_t c : tet[t])
                if (c != from && c != to) list.push_back(c);
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        return list;
    };
    const std::vector<std::uint32_t> near_from = others(around[from]), near_to = others(around[to]),
                                     at = others(at_edge(from, to));
    std::vector<std::uint32_t> both;
    std::set_intersection(near_from.begin(), near_from.end(), near_to.begin(), near_to.end(),
                          std::back_inserter(both));
    return both == at;
}

double TetComplex::cosine_if_collapsed(std::uint32_t from, std::uint32_t to) const {
    double widest = -1.0;
    for (const std::uint32_t t : around[from]) {
        if (has(t, to)) continue;
        widest = std::max(widest, cosine_if_moved(t, from, point[to]));
        if (widest > 1.0) break;
    }
    return widest;
}

void TetComplex::collapse(std::uint32_t from, std::uint32_t to) {
    const std::vector<std::uint32_t> old = around[from];
    for (const std::uint32_t t : old) {
        Tetrahedron changed = tet[t];
        const int of = region[t];
        const bool gone = has(t, to);
        remove_tet(t);
        if (gone) continue;
        std::replace(changed.begin(), changed.end(), from, to);
        add_tet(changed, of);
    }
}

void TetComplex::replace(std::span<const std::uint32_t> old, std::span<const Tetrahedron> by, int of) {
    for (const std::uint32_t t : old) remove_tet(t);
    for (const Tetrahedron& t : by) add_tet(t, of);
}

}  // namespace sidewall::surface
