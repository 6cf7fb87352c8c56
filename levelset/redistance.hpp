#pragma once
#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

namespace sidewall::levelset {

struct Band;

/// Numbers of sweeps that restore a distance after a time step, and that make one of a Start::function.
inline constexpr int kSweepsAfterTimeStep = 2, kSweepsAnew = 8;

/// What phi is before it is re-distanced.
enum class Start {
    distance,  ///< a distance before the last motion: near edges of the front, values are kept that lie
               ///< between the estimates by differences along the axes and by the edges
    function   ///< any function with the right front
};

/// Makes \p grid a signed distance again without moving its front, and fits the narrow band to the front.
///
/// Nodes next to the front (with a neighbour of the other sign) are only scaled by a factor that brings
/// |grad phi| back to 1 where the surface is smooth, so that zero crossings stay in place (Russo and Smereka,
/// J. Comput. Phys. 163 (2000) 51, name the problem this avoids). All others get the second-order upwind
/// solution of |grad phi| = 1 (Sethian, SIAM Rev. 41 (1999) 199, section 3.3) and, near edges of the front,
/// the distance from these (levelset/edge_distance.hpp). The band gains voxels where the front came nearer
/// and loses those that are far from it.
///
/// A gap or a wall that holds no nodes but on the front (kOnFront) is removed.
///
/// \param sweeps  number of Jacobi sweeps over the band: a distance travels a node a sweep, and results do
///                not depend on where leaves begin. kSweepsAfterTimeStep suffice for a time step of at most
///                half a cell. The first sweep rescales the nodes next to the front.
/// \throws NumericsError if a value is not finite or no front is left.
/// \note Parallel; the same bits on any number of threads.
void redistance(Grid& grid, const Domain& domain, int sweeps = kSweepsAfterTimeStep,
                Start start = Start::distance);

/// Re-distances only the leaves of \p band that are not at rest (levelset/band.hpp); no other would change.
void redistance(Band& band, Grid& grid, const Domain& domain, int sweeps, Start start = Start::distance);

}  // namespace sidewall::levelset
