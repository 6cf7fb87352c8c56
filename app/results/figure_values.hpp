#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "app/recipe/figure_names.hpp"
#include "app/results/cut_profile.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/pieces.hpp"

namespace sidewall::app {

/// A wafer and where a vertical plane cuts it: what figures are measured on, each part found when it is first asked for.
class WaferCut {
  public:
    /// \param surface  as extracted from \p stack.
    /// \pre both outlive it.
    WaferCut(const levelset::MaterialStack& stack, const TriangleMesh& surface, const surface::Plane& plane)
        : stack_(stack), surface_(surface), plane_(plane) {}

    const levelset::MaterialStack& stack() const { return stack_; }
    const TriangleMesh& surface() const { return surface_; }
    const surface::Plane& plane() const { return plane_; }
    const std::vector<levelset::SurfacePiece>& pieces();
    /// The surface without closed voids, which are no openings, and its profile.
    const TriangleMesh& open_surface();
    const Profile& open();
    /// The boundary between a layer and what lies above it.
    const Profile& layer(std::size_t k);
    /// Stretches of a line in a material. \param solid  finds those below one profile.
    Stretches of_material(int material, const std::function<Stretches(const Profile&)>& solid);

  private:
    const levelset::MaterialStack& stack_;
    const TriangleMesh& surface_;
    surface::Plane plane_;
    std::optional<std::vector<levelset::SurfacePiece>> pieces_;
    std::optional<std::optional<TriangleMesh>> open_surface_;  // nothing inside if there are no voids
    std::optional<Profile> open_;
    std::vector<std::optional<Profile>> layers_;
};

/// A figure at a place or of a material; NaN where it does not exist.
/// \note O(n) in triangles, but ler and lwr, which cut once a cell along the line: O(n cells).
double figure_value(const Recipe& recipe, const Figure& figure, WaferCut& cut);

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
