#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "simplify/collapse_mesh.hpp"

namespace sidewall::simplify {

/// A triangle of which a collapse moves one corner and keeps the other two.
struct MovedTriangle {
    std::uint32_t triangle;
    std::uint32_t u, w;  ///< the corners that stay, in the triangle's order after the one that moves
};

/// Distance between a mesh and its original, measured before each collapse at the vertices of both. Every
/// vertex of the original (a point) belongs to a nearby triangle of the simplified mesh, every vertex of that
/// mesh to a nearby point. Only nearby triangles are measured: no distance is less than the true one.
class Deviation {
  public:
    /// What within() finds for apply(); scratch memory of one worker.
    struct Plan {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> points;  ///< points and their new triangles
        std::uint32_t home = 0;                                       ///< point near to the merged vertex
    };

    /// Remembers \p mesh as the original.
    explicit Deviation(const CollapseMesh& mesh);

    /// Whether distances stay within \p limit if the edge from \p a to \p b collapses to \p place.
    /// \param moved  the triangles that stay and change.
    /// \param gone   the one or two triangles that vanish.
    /// \param plan   filled in for apply().
    bool within(double limit, const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, const Vec3& place,
                std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone, Plan& plan) const;

    /// Number of points that belong to those triangles, which within() has to measure.
    std::size_t points_at(std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone) const;

    /// Records the collapse that within() has just measured; \p a is the vertex that stays.
    void apply(std::uint32_t a, std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone,
               const Plan& plan);

  private:
    /// Squared distance from \p p to the original; moves \p home on until no neighbouring point is nearer.
    double distance2_to_original(const Vec3& p, std::uint32_t& home) const;

    std::vector<Vec3> points_;                                ///< vertices of the original
    std::vector<std::uint32_t> corner_, opposite_, leaving_;  ///< halfedges of the original, see CollapseMesh
    std::vector<std::uint32_t> first_;  ///< per triangle: head of the linked list of its points
    std::vector<std::uint32_t> next_;   ///< per point: the next one in the same list
    std::vector<std::uint32_t> count_;  ///< per triangle: number of its points
    std::vector<std::uint32_t> home_;   ///< per vertex of the simplified mesh: a point near to it
};

/// A point of the original that a vertex keeps to show what collapses have cut off. Lindstrom and Turk's cost
/// does not: as a volume it is small for a peak of small triangles, and it has no memory. Of two merged
/// vertices the witness farther from the surface of the moment is kept.
struct Witness {
    Vec3 point;
    double distance2 = 0.0;  ///< squared distance to the triangles around the vertex
};

/// The farther of two witnesses after a collapse to \p place. A search for the closest triangle ends at a
/// squared distance of at most \p enough2. O(degree).
Witness farther_witness(const CollapseMesh& mesh, const Vec3& place, std::span<const MovedTriangle> moved,
                        const Vec3& first, const Vec3& second, double enough2);

/// Running mean of the squared distances by which recent collapses moved the surface, to find outliers. It
/// grows as the mesh gets coarser.
struct RecentDistances {
    double mean2 = 0.0;  ///< running mean of the squared distances
    double count = 0.0;  ///< number of collapses that the mean remembers

    void add(double distance2);
    /// Squared distance of a witness that postpones a collapse; infinity for under 200 collapses.
    double limit2() const;
};

}  // namespace sidewall::simplify
