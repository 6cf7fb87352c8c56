#pragma once
#include <cmath>
#include <limits>

#include "surface/extraction/cut_leaves.hpp"

// Tangent planes of the surface where it crosses grid edges.
namespace sidewall::surface {

/// Reads the values of grid nodes, ghosts beyond the sides included. One per thread.
class NodeReader {
  public:
    NodeReader(const CutLeaves& leaves, const LateralGrid& box) : leaves_(leaves), box_(box) {}
    /// The value in grid spacings, NaN where it is not known.
    double operator()(openvdb::Coord node);
    /// LateralGrid::on_node in grid spacings.
    double on_node() const { return box_.on_node / box_.spacing; }
    /// Whether a node lies inside the material. A node on the surface (LateralGrid::on_node) counts as
    /// outside, on every side of a body: neither rounding nor a direction of the grid decides.
    bool inside(const openvdb::Coord& node);
    /// The own node whose value a ghost repeats; an own node itself.
    openvdb::Coord source(openvdb::Coord node) const;

  private:
    bool on_seam(const openvdb::Coord& node) const;

    const CutLeaves& leaves_;
    const LateralGrid& box_;
    openvdb::Coord origin_{std::numeric_limits<int>::max()};
    const FloatLeaf* leaf_ = nullptr;
};

/// The zero of a line between the ends of an edge with values \p a and \p b, from 0 to 1. It is 0.5 if both
/// ends, and so the whole edge, lie on the surface.
inline double chord(double a, double b, double on_node) {
    return std::abs(a) < on_node && std::abs(b) < on_node ? 0.5 : a / (a - b);
}

/// Tangent plane of the surface at a grid edge that it crosses.
struct CrossingPlane {
    double at = 0.0;             ///< where the edge is crossed, 0 at its low node, 1 at the high one
    Vec3 normal = Vec3::Zero();  ///< unit length, out of the material; zero if on_edge, or unknown
    double defect = 0.0;         ///< deviation of the values around from those of a plane; 0: none
    bool on_edge = false;        ///< the crossing lies on an edge between two planes
};

/// Finds the plane by one-sided differences: a distance has a kink on the plane that bisects a surface edge,
/// and differences across it mix two planes. Where the slopes before and behind the crossed grid edge differ,
/// both are extrapolated into it; the first zero from inside is that of a convex edge, the last that of a
/// hollow one (subcell resolution: Harten, J. Comput. Phys. 83, 148, 1989). Slopes along the other axes use
/// the smoothest stencil (ENO: Harten, Engquist, Osher and Chakravarthy, J. Comput. Phys. 71, 231, 1987).
/// \param low, axis  the edge; the values at its ends differ in sign.
CrossingPlane crossing_plane(NodeReader& value, const openvdb::Coord& low, int axis);

}  // namespace sidewall::surface
