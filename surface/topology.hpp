#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Rows of indices in one flat array: row i is items[offsets[i]] .. items[offsets[i + 1] - 1].
struct Rows {
    std::vector<std::uint32_t> offsets{0};
    std::vector<std::uint32_t> items;
    std::size_t size() const { return offsets.size() - 1; }
    std::span<const std::uint32_t> operator[](std::size_t i) const {
        return std::span(items).subspan(offsets[i], offsets[i + 1] - offsets[i]);
    }
};

/// Disjoint sets of 0..n-1 with path halving; the root is the lowest member, whatever the order of joins.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
    std::uint32_t root(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = root(a);
        b = root(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

/// A directed link between two keyed joints, e.g. a cut segment between two mesh edges.
struct Link {
    std::uint64_t from = 0;
    std::uint64_t to = 0;
};

/// A chain of links, each of which begins where the previous one ends.
struct Chain {
    std::vector<std::uint32_t> links;
    bool closed = false;
};

/// Joins links into chains, every link in exactly one: open chains first, then closed ones, each in the order
/// of its first link. Where several links leave a joint, the unused one of lowest index is next. O(n log n).
std::vector<Chain> join_links(const std::vector<Link>& links);

/// All undirected edges, sorted, with their corners. Corner c = 3 t + k stands for the directed edge of
/// triangle t from its vertex k to its vertex (k + 1) % 3. Edges from a vertex to itself are left out.
struct EdgeTable {
    std::vector<std::array<std::uint32_t, 2>> edges;  ///< lower vertex first, ascending
    Rows corners;  ///< per edge, ascending: one on a boundary, two inside the surface

    /// Whether no edge is on a boundary.
    bool closed() const {
        for (std::size_t e = 0; e < edges.size(); ++e)
            if (corners[e].size() == 1) return false;
        return true;
    }
};

/// The edge table of a mesh, O(n log n).
EdgeTable edge_table(const TriangleMesh& mesh);

/// Per vertex, the corners 3 t + k that lie on it, ascending. O(n).
Rows vertex_corners(const TriangleMesh& mesh);

/// Counts, defects and boundary of a mesh.
struct Topology {
    std::size_t vertices = 0;           ///< used by a triangle
    std::size_t isolated_vertices = 0;  ///< used by none
    std::size_t edges = 0;
    std::size_t triangles = 0;
    std::size_t components = 0;            ///< triangles joined through edges or vertices
    std::size_t boundary_edges = 0;        ///< edges of one triangle
    std::size_t nonmanifold_edges = 0;     ///< edges of more than two triangles
    std::size_t nonmanifold_vertices = 0;  ///< vertices whose triangles are not one fan
    std::size_t inconsistent_edges = 0;    ///< edges whose two triangles run along them in the same direction
    std::size_t degenerate_triangles = 0;  ///< zero area, repeated vertices included
    std::size_t duplicate_triangles = 0;   ///< same three vertices as an earlier one
    std::vector<std::array<std::uint32_t, 2>> boundary;  ///< in the direction of their triangle
    Rows boundary_loops;  ///< vertices in order, surface on the left; open only where not manifold

    /// V - E + F: 2 for a sphere, 0 for a torus, 1 for a disk.
    long euler() const {
        return static_cast<long>(vertices) - static_cast<long>(edges) + static_cast<long>(triangles);
    }
    bool closed() const { return boundary_edges == 0; }
    bool manifold() const { return nonmanifold_edges == 0 && nonmanifold_vertices == 0; }
    bool oriented() const { return inconsistent_edges == 0; }
};

/// Analyses connectivity; any mesh is accepted. O(n log n), deterministic.
Topology analyse_topology(const TriangleMesh& mesh);

/// Whether every boundary edge lies exactly in one of the four side planes (x or y) of the mesh's bounding
/// box, as those of an open surface over a rectangular domain do. False for a closed mesh.
bool boundary_on_rectangle(const TriangleMesh& mesh, const Topology& topology);

}  // namespace sidewall::surface
