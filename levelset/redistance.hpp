#pragma once
#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

namespace sidewall::levelset {

struct Band;

/// Sweeps that restore a distance after a time step, and those that make one of any function with the right front.
inline constexpr int kSweepsAfterTimeStep = 2, kSweepsAnew = 8;

/// What phi is before it is re-distanced.
enum class Start {
    distance,  ///< a distance from the front, up to what moved it: near edges, values stay as they are
               ///< between what differences along the axes and the edges give
    function   ///< any function with the right front
};

/// Makes \p grid a signed distance again without moving its front, and fits the narrow band to the front.
///
/// Nodes next to the front (a neighbour of the other sign) keep their value but for a factor that brings
/// |grad phi| back to 1 where the surface is smooth; so the zero crossings stay where they are (Russo and
/// Smereka, J. Comput. Phys. 163 (2000) 51, name the problem this avoids). All others get the second-order
/// upwind solution of |grad phi| = 1 from them (Sethian, SIAM Rev. 41 (1999) 199, section 3.3), and near edges of the front
/// what is known of the distance from these (levelset/edge_distance.hpp). New band voxels are made where the front came nearer, far
/// ones are dropped.
///
/// A gap or a wall of which nodes on the front (kOnFront) are all that is left goes.
///
/// \param sweeps  over the band, each from the values before it, so that a distance travels a node a sweep and no
///                result depends on where leaves begin: kSweepsAfterTimeStep do for one of at most half a cell.
///                The first one rescales the nodes next to the front.
/// \throws NumericsError if a value is not finite or no front is left.
/// \note Parallel; the same bits on any number of threads.
void redistance(Grid& grid, const Domain& domain, int sweeps = kSweepsAfterTimeStep,
                Start start = Start::distance);

/// Re-distances only the leaves of \p band that are not at rest (levelset/band.hpp); no other would change.
void redistance(Band& band, Grid& grid, const Domain& domain, int sweeps, Start start = Start::distance);

}  // namespace sidewall::levelset
