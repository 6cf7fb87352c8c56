#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "simplify/halfedges.hpp"
#include "simplify/symmetric3.hpp"
#include "simplify/vertex_kind.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// A vertex and sums over its triangles and neighbours, from which the cost of any edge follows in constant
/// time. All are relative to the vertex itself: its triangles' planes pass through it, so that they need no
/// offsets and nothing cancels far from the origin. Two cache lines.
struct alignas(64) VertexSums {
    Vec3 position;
    Symmetric3 planes;  ///< sum of n n^T, n = twice the area vector of a triangle
    Vec3 normal;        ///< sum of n
    Vec3 link;          ///< sum of neighbour - position
    double link2;       ///< sum of |neighbour - position|^2
};

enum VertexFlag : std::uint8_t {
    kBoundary = 1,  ///< on the open boundary, frozen vertices too
    kFeature = 2,   ///< given by the caller
    kRegion = 4     ///< in the feature region, which grows from the features
};

struct VertexState {
    std::uint32_t degree = 0;  ///< neighbours
    VertexConstraint constraint;
    std::uint8_t flags = 0;  ///< VertexFlags; a merged vertex has those of both
};

/// The neighbours of a vertex in order: a fan of triangles, whose first edge is a boundary edge if the vertex
/// lies on the boundary.
struct OneRing {
    static constexpr std::uint32_t kMost = 64;        ///< no collapse makes a vertex of more neighbours
    std::array<std::uint32_t, kMost + 2> out;         ///< halfedges leaving the vertex, counter-clockwise
    std::array<std::uint32_t, kMost + 2> neighbours;  ///< their ends; one more than `out` on a boundary
    std::uint32_t triangles = 0, size = 0;            ///< entries of `out` and of `neighbours`
};

/// A mesh that edges are collapsed in, on flat arrays; halfedge 3 t + k runs from corner k of triangle t to
/// its next corner. Positions are centred and scaled by a power of two to a mean edge of about one.
struct CollapseMesh {
    std::vector<std::uint32_t> corner;    ///< per halfedge: vertex it starts from; kNoHalfedge once removed
    std::vector<std::uint32_t> opposite;  ///< per halfedge; kNoHalfedge on the boundary
    std::vector<std::uint32_t> leaving;  ///< per vertex: a halfedge leaving it, on the boundary its first one
    std::vector<VertexState> state;
    std::vector<VertexSums> sums;
    Vec3 centre = Vec3::Zero();
    double scale = 1.0;
    Vec3 low, high;  ///< box of the input; no vertex leaves it

    /// \throws GeometryError as connect() does.
    explicit CollapseMesh(const TriangleMesh& input);

    static std::uint32_t next(std::uint32_t h) { return next_in_triangle(h); }
    static std::uint32_t previous(std::uint32_t h) { return previous_in_triangle(h); }
    std::uint32_t start(std::uint32_t h) const { return corner[h]; }
    std::uint32_t end(std::uint32_t h) const { return corner[next(h)]; }
    bool removed(std::uint32_t h) const { return corner[h] == kNoHalfedge; }
    bool flagged(std::uint32_t v, int flag) const { return (state[v].flags & flag) != 0; }
    MergedPlace merged_place(std::uint32_t h) const {
        return simplify::merged_place(state[start(h)].constraint, state[end(h)].constraint,
                                      opposite[h] == kNoHalfedge);
    }
    const Vec3& position(std::uint32_t v) const { return sums[v].position; }
    /// The one of the two halfedges that stands for the edge.
    std::uint32_t edge(std::uint32_t h) const { return opposite[h] < h ? opposite[h] : h; }
    bool is_edge(std::uint32_t h) const { return corner[h] != kNoHalfedge && h < opposite[h]; }

    /// \pre no more than OneRing::kMost neighbours.
    void ring(std::uint32_t v, OneRing& result) const;

    Vec3 to_mesh(const Vec3& world) const { return (world - centre) * scale; }
    Vec3 to_world(const Vec3& p) const { return p / scale + centre; }

    /// Removes the end of \p h and the one or two triangles beside it; its start takes the place. Arrays of
    /// connectivity only. \p end is the ring of the vertex that goes.
    void unlink(std::uint32_t h, const OneRing& end);

  private:
    void sum_up(std::uint32_t v, std::vector<std::uint32_t>& neighbours);
};

}  // namespace sidewall::simplify
