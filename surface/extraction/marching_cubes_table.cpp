#include <algorithm>
#include <limits>

#include "surface/extraction/marching_cubes.hpp"

// The table is derived, not copied: walk around each face of the cell, join the edges where the walk enters
// and leaves the inside, chain the joins to polygons, and triangulate these without diagonals in a face.
namespace sidewall::surface {
namespace {

using Loop = std::vector<int>;

int edge_between(int corner_a, int corner_b) {
    for (int e = 0; e < 12; ++e) {
        const int a = edge_corner(e), b = a + (1 << e / 4);
        if ((a == corner_a && b == corner_b) || (a == corner_b && b == corner_a)) return e;
    }
    return -1;
}

// The four corners of a face, counter-clockwise seen from outside the cell.
std::array<int, 4> face_corners(int axis, int side) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
    if (side == 1) return {base, base + u, base + u + v, base + v};
    return {base, base + v, base + u + v, base + u};
}

bool share_face(int e, int f) {
    const int ea = edge_corner(e), eb = ea + (1 << e / 4), fa = edge_corner(f), fb = fa + (1 << f / 4);
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const auto on = [&](int corner) { return (corner >> axis & 1) == side; };
            if (on(ea) && on(eb) && on(fa) && on(fb)) return true;
        }
    return false;
}

// Polygons around the inside corners. On a face every run of inside corners gives one segment, from where the
// walk enters it to where it leaves: two inside corners across a diagonal stay apart.
std::vector<Loop> loops(int pattern) {
    std::array<int, 12> next;
    next.fill(-1);
    const auto is_inside = [&](int corner) { return (pattern >> corner & 1) != 0; };
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const auto corner = face_corners(axis, side);
            for (std::size_t i = 0; i < 4; ++i) {
                if (is_inside(corner[i]) || !is_inside(corner[(i + 1) % 4])) continue;
                const int enter = edge_between(corner[i], corner[(i + 1) % 4]);
                std::size_t last = (i + 1) % 4;
                while (is_inside(corner[(last + 1) % 4])) last = (last + 1) % 4;
                const int leave = edge_between(corner[last], corner[(last + 1) % 4]);
                next[static_cast<std::size_t>(enter)] = leave;
            }
        }
    std::vector<Loop> result;
    std::array<bool, 12> used{};
    for (std::size_t e = 0; e < 12; ++e) {
        if (next[e] < 0 || used[e]) continue;
        Loop loop;
        for (std::size_t k = e; !used[k]; k = static_cast<std::size_t>(next[k])) {
            used[k] = true;
            loop.push_back(static_cast<int>(k));
        }
        result.push_back(loop);
    }
    return result;
}

double diagonal_cost(int e, int f) {
    // A diagonal in a face would be drawn by the neighbour cell too and make a non-manifold edge.
    if (share_face(e, f)) return 1e6;
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const auto middle = [&](int edge) { return edge / 4 == axis ? 0.5 : edge_corner(edge) >> axis & 1; };
        squared += (middle(e) - middle(f)) * (middle(e) - middle(f));
    }
    return squared;
}

// The cheapest triangulation of loop[first..last], by recursion over the third vertex (loops are small).
double triangulate(const Loop& loop, std::size_t first, std::size_t last,
                   std::vector<std::uint8_t>& triangles) {
    if (last - first < 2) return 0.0;
    double best = std::numeric_limits<double>::infinity();
    std::vector<std::uint8_t> best_triangles;
    for (std::size_t k = first + 1; k < last; ++k) {
        std::vector<std::uint8_t> trial;
        double cost = triangulate(loop, first, k, trial) + triangulate(loop, k, last, trial);
        if (k > first + 1) cost += diagonal_cost(loop[first], loop[k]);
        if (k + 1 < last) cost += diagonal_cost(loop[k], loop[last]);
        if (cost >= best) continue;
        best = cost;
        for (std::size_t corner : {first, k, last}) trial.push_back(static_cast<std::uint8_t>(loop[corner]));
        best_triangles = trial;
    }
    triangles.insert(triangles.end(), best_triangles.begin(), best_triangles.end());
    return best;
}

}  // namespace

const std::array<std::vector<std::uint8_t>, 256>& marching_cubes_table() {
    static const auto table = [] {
        std::array<std::vector<std::uint8_t>, 256> t;
        for (int pattern = 0; pattern < 256; ++pattern)
            for (const Loop& loop : loops(pattern))
                triangulate(loop, 0, loop.size() - 1, t[static_cast<std::size_t>(pattern)]);
        return t;
    }();
    return table;
}

const std::vector<int>& polygon_of(std::size_t pattern) {
    static const auto polygons = [] {
        std::array<Loop, 256> p;
        for (std::size_t k = 0; k < p.size(); ++k)
            if (const auto all = loops(static_cast<int>(k)); all.size() == 1) p[k] = all.front();
        return p;
    }();
    return polygons[pattern];
}

}  // namespace sidewall::surface
