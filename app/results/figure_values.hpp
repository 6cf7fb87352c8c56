#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "app/recipe/figure_names.hpp"
#include "app/results/cut_profile.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/pieces.hpp"

namespace sidewall::app {

/// A wafer and its cut by a vertical plane, on which figures are measured. Parts are computed on first use.
class WaferCut {
  public:
    /// \param surface  as extracted from \p stack.
    /// \pre \p stack and \p surface outlive this object.
    WaferCut(const levelset::MaterialStack& stack, const TriangleMesh& surface, const surface::Plane& plane)
        : stack_(stack), surface_(surface), plane_(plane) {}

    const levelset::MaterialStack& stack() const { return stack_; }
    const TriangleMesh& surface() const { return surface_; }
    const surface::Plane& plane() const { return plane_; }
    const std::vector<levelset::SurfacePiece>& pieces();
    /// The surface without the walls of closed voids, which are no openings, and its profile.
    const TriangleMesh& open_surface();
    const Profile& open();
    /// The boundary between a layer and what lies above it.
    const Profile& layer(std::size_t k);
    /// What the uppermost layer lies on: the boundary below it, without the walls of voids closed there.
    /// \pre the wafer has two layers at least.
    const Profile& open_below();
    /// Intervals of a line in a material. \param solid  finds those below one profile.
    Stretches of_material(int material, const std::function<Stretches(const Profile&)>& solid);

  private:
    const levelset::MaterialStack& stack_;
    const TriangleMesh& surface_;
    surface::Plane plane_;
    std::optional<std::vector<levelset::SurfacePiece>> pieces_;
    std::optional<std::optional<TriangleMesh>> open_surface_;  // nothing inside if there are no voids
    std::optional<Profile> open_, open_below_;
    std::vector<std::optional<Profile>> layers_;
};

/// The value of a figure at a place or of a material; NaN where it does not exist.
/// \note O(n) in triangles; for ler and lwr, which cut once a cell along the line, O(n * cells).
double figure_value(const Recipe& recipe, const Figure& figure, WaferCut& cut);

/// Closed voids: gas enclosed by material. Those of less than a cell's volume do not count, nor does gas
/// below a roof across the whole domain.
struct Voids {
    int count = 0;
    double volume = 0.0;  ///< total, of the parts in the domain
    /// Total volume with mirror images: twice at a reflective side, four times where two meet; axial: once.
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
