#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "simplify/vertex_kind.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Index that stands for no halfedge or no vertex.
inline constexpr std::uint32_t kNoHalfedge = 0xffffffffu;

/// Checks that coordinates and indices are usable.
/// \throws GeometryError if the mesh is too large for 32-bit halfedge indices, a coordinate is not finite or
///         beyond 1e50, an index is out of range or a triangle uses a vertex twice.
void check_arrays(const TriangleMesh& mesh);

/// Connects the triangles of an orientable 2-manifold with or without boundary, in O(n). Halfedge 3 t + k
/// runs from corner k of triangle t to its next corner.
/// \returns per halfedge its opposite in the neighbouring triangle, or kNoHalfedge on the boundary.
/// \throws GeometryError, naming the place and a remedy, as check_arrays does, and if an edge has more than
///         two triangles, two neighbours are oriented against each other, or a vertex has more than one fan.
std::vector<std::uint32_t> opposite_halfedges(const TriangleMesh& mesh);

/// Makes a mesh of the remaining triangles, in the input's order and with their `material`, and of the
/// vertices that they use. Other attributes are left out.
/// \param corner    the vertex at each corner of the input's triangles, kNoHalfedge for removed triangles.
/// \param position  returns the new position of an input vertex.
TriangleMesh assemble(const TriangleMesh& input, std::span<const std::uint32_t> corner,
                      const std::function<Vec3(std::uint32_t)>& position);

/// A symmetric 3 x 3 matrix stored as six numbers.
struct Symmetric3 {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

    /// Adds \p s v v^T.
    void add_outer(const Vec3& v, double s) {
        const double x = s * v.x(), y = s * v.y(), z = s * v.z();
        xx += x * v.x(), xy += x * v.y(), xz += x * v.z();
        yy += y * v.y(), yz += y * v.z(), zz += z * v.z();
    }
    /// Adds \p s times |u|^2 I - u u^T, the matrix of the map v -> u x (v x u).
    void add_cross(const Vec3& u, double s) {
        const double square = s * u.squaredNorm();
        add_outer(u, -s);
        xx += square, yy += square, zz += square;
    }
    void add(const Symmetric3& m, double s = 1.0) {
        xx += s * m.xx, xy += s * m.xy, xz += s * m.xz;
        yy += s * m.yy, yz += s * m.yz, zz += s * m.zz;
    }
    double trace() const { return xx + yy + zz; }
    Vec3 operator*(const Vec3& v) const {
        return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
                xz * v.x() + yz * v.y() + zz * v.z()};
    }
};

/// Position of a vertex and sums over its triangles and neighbours, from which the cost of any edge follows
/// in constant time. The sums take the vertex as origin: the planes of its triangles pass through it, so the
/// quadric has no linear or constant term, and nothing cancels far from the mesh's origin. Two cache lines.
struct alignas(64) VertexSums {
    Vec3 position;
    Symmetric3 planes;  ///< sum of n n^T, n = twice the area vector of a triangle
    Vec3 normal;        ///< sum of n
    Vec3 link;          ///< sum of neighbour - position
    double link2;       ///< sum of |neighbour - position|^2
};

enum VertexFlag : std::uint8_t {
    kBoundary = 1,  ///< on the open boundary, frozen vertices included
    kFeature = 2,   ///< feature, flagged by the caller
    kRegion = 4     ///< in the feature region, which starts as the features and grows
};

struct VertexState {
    std::uint32_t degree = 0;  ///< number of neighbours
    VertexConstraint constraint;
    std::uint8_t flags = 0;  ///< VertexFlag bits; a merged vertex has those of both
};

/// Triangles and neighbours around a vertex, counter-clockwise; on the boundary from a boundary edge on.
struct OneRing {
    static constexpr std::uint32_t kMost = 64;        ///< largest degree that a collapse may produce
    std::array<std::uint32_t, kMost + 2> out;         ///< halfedges leaving the vertex, counter-clockwise
    std::array<std::uint32_t, kMost + 2> neighbours;  ///< their ends; one more than `out` on a boundary
    std::uint32_t triangles = 0, size = 0;            ///< entries of `out` and of `neighbours`
};

/// Halfedge mesh on flat arrays for edge collapses. Positions are relative to the box's centre and scaled by
/// a power of two so that the mean edge length is about 1.
struct CollapseMesh {
    std::vector<std::uint32_t> corner;    ///< per halfedge: vertex it starts from; kNoHalfedge once removed
    std::vector<std::uint32_t> opposite;  ///< per halfedge: see opposite_halfedges()
    std::vector<std::uint32_t> leaving;   ///< per vertex: a halfedge leaving it, the boundary one if any
    std::vector<VertexState> state;
    std::vector<VertexSums> sums;
    Vec3 centre = Vec3::Zero();
    double scale = 1.0;
    Vec3 low, high;  ///< bounding box of the input, centred and scaled; no vertex leaves it

    /// \throws GeometryError as opposite_halfedges() does.
    explicit CollapseMesh(const TriangleMesh& input);

    /// Halfedges of the same triangle.
    static std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
    static std::uint32_t previous(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
    std::uint32_t start(std::uint32_t h) const { return corner[h]; }
    std::uint32_t end(std::uint32_t h) const { return corner[next(h)]; }
    bool removed(std::uint32_t h) const { return corner[h] == kNoHalfedge; }
    bool flagged(std::uint32_t v, int flag) const { return (state[v].flags & flag) != 0; }
    MergedPlace merged_place(std::uint32_t h) const {
        return simplify::merged_place(state[start(h)].constraint, state[end(h)].constraint,
                                      opposite[h] == kNoHalfedge);
    }
    const Vec3& position(std::uint32_t v) const { return sums[v].position; }
    /// The lower of an edge's two halfedges, which stands for the edge.
    std::uint32_t edge(std::uint32_t h) const { return opposite[h] < h ? opposite[h] : h; }
    bool is_edge(std::uint32_t h) const { return corner[h] != kNoHalfedge && h < opposite[h]; }

    /// \pre \p v has no more than OneRing::kMost neighbours.
    void ring(std::uint32_t v, OneRing& result) const;

    Vec3 to_mesh(const Vec3& world) const { return (world - centre) * scale; }
    Vec3 to_world(const Vec3& p) const { return p / scale + centre; }

    /// Removes the end of \p h and the one or two triangles beside it; its other triangles go to the start of
    /// \p h. Changes connectivity only, not `sums` and `state`. \p end is the ring of the end.
    void unlink(std::uint32_t h, const OneRing& end);

  private:
    void sum_up(std::uint32_t v, std::vector<std::uint32_t>& neighbours);
};

}  // namespace sidewall::simplify
