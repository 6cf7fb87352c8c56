#include "levelset/meshes/extract.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "levelset/grid_leaves.hpp"
#include "levelset/meshes/level_cells.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/extraction/marching_cubes.hpp"

// Marching cubes meshes the cells of each level, except the seam: cells of a coarser level that touch cells
// of the finer one. A face that a seam cell shares with finer cells has nine nodes of the finer level and
// four of the coarser one (+):
//
// clang-format off
//     +-------+-------+      The five nodes between get the mean of their neighbours (+), so
//     |       .       |      that an edge is crossed where the coarser level crosses it, at
//     |       .       |      most once. Marching cubes of the finer level leaves segments on
//     . . . . . . . . .      the four squares. These segments, and on the other faces those
//     |       .       |      of the coarse neighbours, bound the seam cell's surface: they
//     |       .       |      form closed loops, each filled by triangles around its centre.
//     +-------+-------+
// clang-format on
namespace sidewall::levelset {
namespace {

using openvdb::Coord;

// Bits of a node's index without its sign; only an index along z may be negative.
constexpr int kIndexBits = 20;

std::uint64_t key_of(const Coord& low, int axis) {
    const auto part = [](int n) { return static_cast<std::uint64_t>(n + (1 << kIndexBits)); };
    return ((part(low.x()) << (kIndexBits + 1) | part(low.y())) << (kIndexBits + 1) | part(low.z())) << 2 |
           static_cast<std::uint64_t>(axis);
}

using EdgeVertices = std::unordered_map<std::uint64_t, std::uint32_t>;

// A cell of the coarser level that touches cells of the finer one.
struct SeamCell {
    Coord cell;
    std::array<float, 8> corner;  // corner c has x = c & 1, y = c >> 1 & 1, z = c >> 2
};

// A face of a cell, its corners counter-clockwise seen from outside.
struct Face {
    int x, y;  // offset of the cell across it; both 0 for the low and high faces along z
    std::array<int, 4> corner;
};
// Lateral faces first.
constexpr std::array<Face, 6> kCellFaces = {{{-1, 0, {0, 4, 6, 2}},
                                             {1, 0, {1, 3, 7, 5}},
                                             {0, -1, {0, 1, 5, 4}},
                                             {0, 1, {2, 6, 7, 3}},
                                             {0, 0, {0, 2, 3, 1}},
                                             {0, 0, {4, 5, 7, 6}}}};

// A node of the finer level, and its value.
struct Node {
    Coord at;
    float value;
};

Node between(const Node& a, const Node& b) {
    return {Coord((a.at.x() + b.at.x()) / 2, (a.at.y() + b.at.y()) / 2, (a.at.z() + b.at.z()) / 2),
            0.5f * (a.value + b.value)};
}

// The seam cells that the front passes through, in the order of the grid's leaves.
std::vector<SeamCell> seam_cells(const Grid& grid, const Domain& domain, const LevelCells& cells) {
    std::vector<SeamCell> result;
    const auto accessor = grid.getConstAccessor();
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        const Coord o = leaf->origin();
        bool any = false;
        for (int n = 0; n < 64 && !any; ++n) any = cells.is_seam(o.x() + n / 8, o.y() + n % 8);
        if (!any) continue;
        for (auto it = leaf->cbeginValueOn(); it; ++it) {
            SeamCell seam{it.getCoord(), {}};
            if (!cells.is_seam(seam.cell.x(), seam.cell.y())) continue;
            bool complete = true, in = false, out = false;
            for (int c = 0; c < 8; ++c) {
                const Coord node(domain.source_node(0, seam.cell.x() + (c & 1)),
                                 domain.source_node(1, seam.cell.y() + (c >> 1 & 1)),
                                 seam.cell.z() + (c >> 2));
                float& value = seam.corner[static_cast<std::size_t>(c)];
                const bool known =
                    accessor.probeValue(node, value);  // else a tile value, whose sign has no meaning
                complete = complete && known;
                in = in || (known && value < 0.0f);
                out = out || (known && !(value < 0.0f));
            }
            if (!in || !out) continue;
            if (!complete)
                throw NumericsError(
                    "the narrow band does not enclose the surface; re-distance the level set before extracting");
            result.push_back(seam);
        }
    }
    return result;
}

Node corner_of(const SeamCell& seam, int c) {
    const Coord at(seam.cell.x() + (c & 1), seam.cell.y() + (c >> 1 & 1), seam.cell.z() + (c >> 2));
    return {at << 1, seam.corner[static_cast<std::size_t>(c)]};
}

// The nine fine nodes of a face beside finer cells: corners, midpoint of the edge after each, centre.
std::array<Node, 9> nodes_of(const SeamCell& seam, const Face& face) {
    std::array<Node, 9> node;
    for (std::size_t k = 0; k < 4; ++k) node[k] = corner_of(seam, face.corner[k]);
    for (std::size_t k = 0; k < 4; ++k) node[4 + k] = between(node[k], node[(k + 1) % 4]);
    node[8] = between(between(node[0], node[2]), between(node[1], node[3]));
    return node;
}

// The interpolated values of the finer level's nodes on the seam.
NodeValues values_on_seam(const std::vector<SeamCell>& seams, const LevelCells& cells, const Domain& finer) {
    NodeValues values;
    for (const SeamCell& seam : seams)
        for (const Face& face : kCellFaces) {
            if ((face.x == 0 && face.y == 0) ||
                !cells.is_finer(seam.cell.x() + face.x, seam.cell.y() + face.y))
                continue;
            for (const Node& node : nodes_of(seam, face))
                if (finer.owns(node.at.x(), node.at.y())) values.emplace_back(node.at, node.value);
        }
    return values;
}

// Collects the segments that bound the surface of a seam cell.
class SeamLines {
  public:
    SeamLines(const LevelCells& cells, const EdgeVertices& coarse, const EdgeVertices& fine)
        : cells_(cells), coarse_(coarse), fine_(fine) {}

    // The closed loops of vertices, counter-clockwise seen from outside the material.
    std::vector<std::vector<std::uint32_t>> around(const SeamCell& seam) {
        next_.clear();
        for (const Face& face : kCellFaces) {
            const bool finer = (face.x != 0 || face.y != 0) &&
                               cells_.is_finer(seam.cell.x() + face.x, seam.cell.y() + face.y);
            const std::array<Node, 9> node = nodes_of(seam, face);
            if (!finer) {
                draw({node[0], node[1], node[2], node[3]});
                continue;
            }
            for (std::size_t k = 0; k < 4; ++k) draw({node[k], node[4 + k], node[8], node[4 + (k + 3) % 4]});
        }
        std::vector<std::vector<std::uint32_t>> loops;
        while (!next_.empty()) {
            std::vector<std::uint32_t> loop;
            for (auto at = next_.begin(); at != next_.end();) {
                loop.push_back(at->first);
                const std::uint32_t to = at->second;
                next_.erase(at);
                at = std::find_if(next_.begin(), next_.end(), [&](const auto& l) { return l.first == to; });
            }
            loops.push_back(std::move(loop));
        }
        return loops;
    }

  private:
    // Adds the segments on a square: one around each run of inside corners, from the edge that enters the run
    // to the one that leaves it.
    void draw(const std::array<Node, 4>& corner) {
        const auto in = [&](std::size_t k) { return corner[k % 4].value < 0.0f; };
        for (std::size_t k = 0; k < 4; ++k) {
            if (in(k + 3) || !in(k)) continue;
            std::size_t last = k;
            while (in(last + 1)) ++last;
            next_.emplace_back(vertex(corner[(k + 3) % 4], corner[k]),
                               vertex(corner[last % 4], corner[(last + 1) % 4]));
        }
    }
    std::uint32_t vertex(const Node& a, const Node& b) const {
        const Coord way = b.at - a.at;
        const int axis = way.x() != 0 ? 0 : way.y() != 0 ? 1 : 2;
        const Coord low = Coord::minComponent(a.at, b.at);
        if (std::abs(way[axis]) == 1) return find(fine_, low, axis);
        const Coord node(low.x() >> 1, low.y() >> 1, low.z() >> 1);
        if (!is_shared(node, axis)) return find(coarse_, node, axis);
        const Node middle = between(a, b);
        return (middle.value < 0.0f) != (a.value < 0.0f) ? vertex(a, middle) : vertex(middle, b);
    }
    // Whether finer cells lie around an edge.
    bool is_shared(const Coord& low, int axis) const {
        for (int i = low.x() - (axis == 0 ? 0 : 1); i <= low.x(); ++i)
            for (int j = low.y() - (axis == 1 ? 0 : 1); j <= low.y(); ++j)
                if (cells_.is_finer(i, j)) return true;
        return false;
    }
    static std::uint32_t find(const EdgeVertices& vertices, const Coord& low, int axis) {
        const auto found = vertices.find(key_of(low, axis));
        if (found == vertices.end())
            throw NumericsError("the levels of the grid do not meet in one surface: use levels = 1");
        return found->second;
    }

    const LevelCells& cells_;
    const EdgeVertices &coarse_, &fine_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> next_;
};

void fill(const std::vector<std::uint32_t>& loop, TriangleMesh& mesh) {
    if (loop.size() == 3) return mesh.triangles.push_back({loop[0], loop[1], loop[2]});
    Vec3 centre = Vec3::Zero();
    for (const std::uint32_t v : loop) centre += mesh.vertices[v] / static_cast<double>(loop.size());
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(centre);
    for (std::size_t k = 0; k < loop.size(); ++k)
        mesh.triangles.push_back({loop[k], loop[(k + 1) % loop.size()], middle});
}

// The columns of leaves with vertices that seam cells of this level (own) or of the coarser one may need.
class BesideSeam {
  public:
    BesideSeam(const Domain& domain, const std::vector<SeamCell>& own, const std::vector<SeamCell>* coarser)
        : domain_(domain), rows_((domain.cells[1] >> 3) + 1) {
        flags_.resize(static_cast<std::size_t>(((domain.cells[0] >> 3) + 1) * rows_), 0);
        for (const SeamCell& seam : own) mark(seam.cell.x(), seam.cell.y(), 1);
        if (coarser != nullptr)
            for (const SeamCell& seam : *coarser) mark(2 * seam.cell.x(), 2 * seam.cell.y(), 2);
    }
    bool has(const Vec3& point) const {
        const Vec3 index = domain_.to_index(point);
        return flags_[at(static_cast<int>(index.x()), static_cast<int>(index.y()))] != 0;
    }

  private:
    // Marks the columns of a cell, widened by a node so that rounding does not matter.
    void mark(int x, int y, int size) {
        for (const int i : {x - 1, x + size + 1})
            for (const int j : {y - 1, y + size + 1}) flags_[at(i, j)] = 1;
    }
    std::size_t at(int i, int j) const {
        const int x = std::clamp(i, 0, domain_.cells[0]) >> 3, y = std::clamp(j, 0, domain_.cells[1]) >> 3;
        return static_cast<std::size_t>(x * rows_ + y);
    }
    const Domain& domain_;
    int rows_;
    std::vector<std::uint8_t> flags_;
};

/// The front of a layer of a stack of several levels as one mesh; only its part near \p around, if given.
TriangleMesh mesh_of_levels(const MaterialStack& stack, std::size_t layer, surface::SharpEdges edges,
                            const surface::Plane* around, const EdgesIn& edges_in = {}) {
    std::vector<const MaterialStack*> levels;
    for (const MaterialStack* level = &stack; level != nullptr; level = level->coarser.get())
        levels.push_back(level);
    std::vector<LevelCells> cells;
    // How far from the plane cells are meshed: the seam cells that it meets, and a cell more for the joints
    // of sharp edges.
    double distance = 2.0 * levels.back()->domain.spacing;
    std::vector<Near> near(levels.size());
    for (std::size_t n = levels.size(); n-- > 0;) {
        near[n] = {around, distance};
        distance += 2.0 * levels[n]->domain.spacing;  // the finer cells beside the seam
    }
    for (std::size_t n = 0; n < levels.size(); ++n)
        cells.emplace_back(*levels[n], n > 0 ? levels[n - 1] : nullptr, near[n]);
    std::vector<std::vector<SeamCell>> seams;
    for (std::size_t n = 0; n < levels.size(); ++n)
        seams.push_back(n > 0 ? seam_cells(*levels[n]->layers[layer].phi, levels[n]->domain, cells[n])
                              : std::vector<SeamCell>());
    TriangleMesh mesh;
    EdgeVertices finer;  // the next finer level's vertices on the seam
    for (std::size_t n = 0; n < levels.size(); ++n) {
        const Domain& domain = levels[n]->domain;
        const bool has_coarser = n + 1 < levels.size();
        const NodeValues on_seam =
            has_coarser ? values_on_seam(seams[n + 1], cells[n + 1], domain) : NodeValues();
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        surface::LateralGrid box = lateral_grid(domain, cells[n].columns);
        if (edges_in)
            box.edges_in = [&](const std::array<int, 3>& cell) { return edges_in(*levels[n], cell); };
        const surface::SharpVertices sharp = surface::marching_cubes(
            GridLeaves(*levels[n]->layers[layer].phi, domain, on_seam).list(), box, mesh, edges);
        add_edges(sharp, mesh);
        EdgeVertices coarse, fine;
        const BesideSeam beside(domain, seams[n], has_coarser ? &seams[n + 1] : nullptr);
        for (std::uint32_t vertex = first; vertex < sharp.first; ++vertex) {
            if (!beside.has(mesh.vertices[vertex])) continue;
            const auto [low, axis] = edge_at(domain.to_index(mesh.vertices[vertex]));
            const std::uint64_t key = key_of(low, axis);
            bool near = false;
            for (int c = 0; c < 4; ++c)
                near = near || cells[n].is_seam(low.x() - (c & 1), low.y() - (c >> 1));
            if (near) coarse.emplace(key, vertex);
            if (has_coarser && (low.x() % LevelColumns::kNodes == 0 || low.y() % LevelColumns::kNodes == 0))
                fine.emplace(key, vertex);
        }
        SeamLines lines(cells[n], coarse, finer);
        for (const SeamCell& seam : seams[n])
            for (const auto& loop : lines.around(seam)) fill(loop, mesh);
        finer = std::move(fine);
    }
    add_edges({}, mesh);  // vertices on seams lie on no edge
    return mesh;
}

}  // namespace

TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer, surface::SharpEdges edges) {
    return stack.coarser ? mesh_of_levels(stack, layer, edges, nullptr)
                         : extract_surface(*stack.layers[layer].phi, stack.domain, edges);
}

TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer, const EdgesIn& edges_in) {
    return mesh_of_levels(stack, layer, surface::SharpEdges::all, nullptr, edges_in);
}

TriangleMesh extract_surface(const MaterialStack& stack, surface::SharpEdges edges) {
    return extract_surface(stack, stack.layers.size() - 1, edges);
}

TriangleMesh extract_around(const MaterialStack& stack, std::size_t layer, const surface::Plane& plane) {
    return mesh_of_levels(stack, layer, surface::SharpEdges::all, &plane);
}

}  // namespace sidewall::levelset
