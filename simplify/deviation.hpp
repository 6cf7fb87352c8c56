#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "simplify/collapse_mesh.hpp"

namespace sidewall::simplify {

/// A triangle that a collapse moves one corner of: the halfedge opposite to that corner stays.
struct MovedTriangle {
    std::uint32_t triangle;
    std::uint32_t u, w;  ///< the corners that stay, in order after the one that moves
};

/// Distance between a mesh and its original: every vertex of the original is kept with a near triangle of the
/// simplified mesh, every vertex of the simplified mesh with one of the original. A collapse is measured before it
/// is made, in both directions, at the vertices. The distances are those to the triangles around, and so never less
/// than those to the whole surface.
class Deviation {
  public:
    /// Scratch of one worker.
    struct Plan {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> points;  ///< original vertex, its next triangle
        std::uint32_t home = 0;  ///< original vertex nearest to the place
    };

    /// Remembers \p mesh as the original.
    explicit Deviation(const CollapseMesh& mesh);

    /// Whether all stays within \p limit if the edge from \p a to \p b goes to \p place. \p moved are the
    /// triangles that stay, \p gone the one or two that go. Fills in the plan.
    bool within(double limit, const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, const Vec3& place,
                std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone, Plan& plan) const;

    /// Number of points that keep to those triangles, which within() has to measure.
    std::size_t points_at(std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone) const;

    /// Follows the collapse that within() has just measured; \p a is the vertex that is left.
    void apply(std::uint32_t a, std::span<const MovedTriangle> moved, std::span<const std::uint32_t> gone,
               const Plan& plan);

  private:
    /// Squared distance from \p p to the original, near to vertex \p home, which follows.
    double distance2_to_original(const Vec3& p, std::uint32_t& home) const;

    std::vector<Vec3> points_;                                ///< of the original
    std::vector<std::uint32_t> corner_, opposite_, leaving_;  ///< of the original
    std::vector<std::uint32_t> first_;                        ///< per triangle: a point that keeps to it
    std::vector<std::uint32_t> next_;                         ///< per point: another one
    std::vector<std::uint32_t> count_;                        ///< per triangle: points that keep to it
    std::vector<std::uint32_t> home_;                         ///< per vertex: point near to it
};

/// Lindstrom and Turk's cost has no memory and is a volume: a peak of small triangles costs little, and what
/// was lost before does not count. So every vertex keeps one point of the original, its witness: the farther
/// one, from the surface of the time, of those of the two vertices it was merged from.
struct Witness {
    Vec3 point;
    double distance2 = 0.0;  ///< to the triangles around
};

/// The farther of two witnesses after a collapse to \p place. Those nearer than
/// \p enough2, squared, are not measured any closer. O(degree).
Witness farther_witness(const CollapseMesh& mesh, const Vec3& place, std::span<const MovedTriangle> moved,
                        const Vec3& first, const Vec3& second, double enough2);

/// Running mean of the distances by which recent collapses moved the surface, to recognise outliers. It grows as
/// the mesh gets coarser.
struct RecentDistances {
    double mean2 = 0.0;  ///< squared distance, a running mean
    double count = 0.0;

    void add(double distance2);
    /// Squared distance of a witness beyond which a collapse is put off; infinity before there are enough.
    double limit2() const;
};

}  // namespace sidewall::simplify
