#pragma once
#include <optional>
#include <vector>

#include "app/results/cut_profile.hpp"
#include "levelset/meshes/pieces.hpp"

namespace sidewall::app {

/// Closed voids: gas that nothing gets into from above. Those of less than a cell's volume do not count, nor does what
/// lies below a roof across the whole domain.
struct Voids {
    int count = 0;
    double volume = 0.0;  ///< of the parts in the domain, in all
    /// Volume with the mirror images that belong to the same voids: a void that ends at a mirrored side counts twice for
    /// it, four times where two such sides meet.
    double whole_volume = 0.0;
    double top = kNone;    ///< z of their highest point
    double width = kNone;  ///< of the widest, along the cut, with its mirror image
};

/// Finds the closed voids below a wafer's surface.
/// \param surface  as extracted.
/// \param pieces   levelset::surface_pieces() of the surface.
/// \param along    unit vector of the cut, along x or y.
Voids voids_in(const TriangleMesh& surface, const std::vector<levelset::SurfacePiece>& pieces,
               const levelset::Domain& domain, const Vec3& along);

/// The surface without the walls of closed voids, however small; nothing if there are none.
/// \param pieces  levelset::surface_pieces() of the surface.
/// \note O(n log n) in triangles.
std::optional<TriangleMesh> open_surface(const TriangleMesh& surface,
                                         const std::vector<levelset::SurfacePiece>& pieces,
                                         const levelset::Domain& domain);

}  // namespace sidewall::app
