#pragma once
#include <string>

#include "app/recipe/recipe.hpp"
#include "levelset/domain.hpp"
#include "surface/triangle_mesh.hpp"

// Profiles in x and z: `extent = [10.0]`, or a strip that is run as one. The grid is one cell wide along y,
// and periodic there.
namespace sidewall::app {

/// Whether the wafer is run as a profile.
bool is_flat(const DomainSection& domain);

/// Whether it is that of a round wafer, see DomainSection::symmetry.
bool is_axial(const DomainSection& domain);

/// Whether it is a profile of what is the same all along y.
bool is_plane_profile(const DomainSection& domain);

/// Checks that a round wafer's domain has one extent and mirrors.
/// \throws KeyError saying what would work.
void check_symmetry(const DomainSection& domain);

/// Whether layers and patterns have no end along y, no layout says where they have, and no rate is of a position.
bool is_same_along_y(const Recipe& recipe);

/// Whether a parsed recipe's wafer is a strip that [domain] strip lets run as a profile.
bool runs_as_profile(const Recipe& recipe);

/// Stretches a profile's mesh along y to the width of the strip that is run as that profile, if it is.
void widen_to_strip(const Recipe& recipe, TriangleMesh& mesh);

/// What the grid's volumes are divided by: 1 in space and for a round wafer; for a profile the grid's width along y, which
/// makes areas of them; for a strip that runs as a profile the share of the strip's width that the grid has.
double width_of_strip(const Recipe& recipe);

/// The unit of a volume after that division.
std::string volume_unit(const Recipe& recipe);

/// How far outlines reach along y, in grid spacings, that a profile takes to have no end there.
inline constexpr double kFarAlongY = 50.0;

/// Checks that a layer or a pattern does not end along y, on a grid of that \p spacing.
/// \throws KeyError naming the shape to use instead.
void refuse_ends_along_y(const Layer& layer, double spacing);

/// Checks that a layer or a pattern of a round wafer is round: about the axis, or a ring, as what has no end along y is.
/// \throws KeyError naming what to use instead.
void refuse_off_axis(const Layer& layer);

/// The number of levels of a recipe's grid: as [grid] says; "auto": up to 3, while the cells along both sides divide and
/// kFewestCoarse of the coarsest are left.
int grid_levels(const Recipe& recipe, const levelset::Domain& domain);

/// Cells of the coarsest level along the shorter side below which "auto" adds none: what is fine around features, some
/// 64 finest cells with margins, would leave little to be coarse.
inline constexpr int kFewestCoarse = 24;

/// The spacing nearest to \p wanted, and not below \p least, that leaves whole cells of the coarsest of so many levels along both
/// sides, and enough, as a recipe writes it; at the least cells as wide as wanted become the coarsest ones. Empty if there
/// is none.
std::string spacing_for(int levels, const DomainSection& domain, double wanted, double least = 0.0);

/// Checks that the domain can have the levels that [grid] asks for.
/// \throws KeyError naming a spacing that lets it.
void check_grid(const GridSection& grid, const DomainSection& domain);

}  // namespace sidewall::app
