#pragma once
#include <span>

#include "simplify/edge_collapse.hpp"

namespace sidewall::simplify {

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
