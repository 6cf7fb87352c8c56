#pragma once
#include <cmath>
#include <limits>

#include "surface/extraction/cut_leaves.hpp"

// Planes of the surface where it crosses edges of the grid.
namespace sidewall::surface {

/// Reads the values of nodes, those beyond the sides too. One to a thread.
class NodeReader {
  public:
    NodeReader(const CutLeaves& leaves, const LateralGrid& box) : leaves_(leaves), box_(box) {}
    /// The value in grid spacings, NaN where it is not known.
    double operator()(openvdb::Coord node);
    /// LateralGrid::on_node in grid spacings.
    double on_node() const { return box_.on_node / box_.spacing; }
    /// Whether a node lies inside the material. One on the surface (LateralGrid::on_node) does not, on whichever side of a body it
    /// lies, so that neither rounding of its value decides nor a direction of the grid.
    bool inside(const openvdb::Coord& node);
    /// The own node that a node repeats.
    openvdb::Coord source(openvdb::Coord node) const;

  private:
    bool on_seam(const openvdb::Coord& node) const;

    const CutLeaves& leaves_;
    const LateralGrid& box_;
    openvdb::Coord origin_{std::numeric_limits<int>::max()};
    const FloatLeaf* leaf_ = nullptr;
};

/// Where a line crosses 0 between the ends of an edge with values \p a and \p b, from 0 to 1: in the middle if both lie on the
/// surface, as all of the edge does then.
inline double chord(double a, double b, double on_node) {
    return std::abs(a) < on_node && std::abs(b) < on_node ? 0.5 : a / (a - b);
}

/// A plane of the surface at an edge of the grid.
struct CrossingPlane {
    double at = 0.0;             ///< where the edge is crossed, 0 at its low node, 1 at the high one
    Vec3 normal = Vec3::Zero();  ///< unit length, out of the material; zero if on_edge, or unknown
    double defect = 0.0;         ///< how far the values around are from those of a plane: 0 for one
    bool on_edge = false;        ///< two planes of the surface cross there
};

/// The plane by differences of one side: a distance has a kink at the planes that halve the angle of an edge, and differences
/// across it mix two planes. Where the slopes before and behind the crossed edge differ, each is continued into it, and the
/// first zero from inside is that of a convex edge, the last that of a hollow one (subcell resolution: Harten, J. Comput.
/// Phys. 83, 148, 1989). Slopes along the other axes are of the stencil that bends least (ENO: Harten, Engquist, Osher and
/// Chakravarthy, J. Comput. Phys. 71, 231, 1987).
/// \param low, axis  the edge; the values at its ends differ in sign.
CrossingPlane crossing_plane(NodeReader& value, const openvdb::Coord& low, int axis);

}  // namespace sidewall::surface
