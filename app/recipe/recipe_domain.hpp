#pragma once
#include <string>

#include "app/recipe/recipe.hpp"
#include "levelset/domain.hpp"
#include "surface/triangle_mesh.hpp"

// Profiles in x and z: `extent = [10.0]`, or a strip run as one. The grid is one cell wide along y, and
// periodic there.
namespace sidewall::app {

/// Whether the wafer is run as a profile, plane or round.
bool is_flat(const DomainSection& domain);

/// Whether the wafer is round: a profile in r = x and z (DomainSection::symmetry).
bool is_axial(const DomainSection& domain);

/// Whether the wafer is run as a profile that is the same at all y.
bool is_plane_profile(const DomainSection& domain);

/// Checks that a round wafer's domain has one extent and reflective sides.
/// \throws KeyError with values that would work.
void check_symmetry(const DomainSection& domain);

/// Whether layers and patterns are endless along y, none is from a layout, and no rate depends on position.
bool is_same_along_y(const Recipe& recipe);

/// Whether a parsed recipe's wafer is a strip that [domain] strip allows to run as a profile.
bool runs_as_profile(const Recipe& recipe);

/// Stretches the profile's mesh along y to the width of the strip if a strip is run as a profile.
void widen_to_strip(const Recipe& recipe, TriangleMesh& mesh);

/// Divisor of the grid's volumes. 1 in space and for a round wafer; the grid's width along y for a profile,
/// which gives areas; the grid's share of the strip's width for a strip run as a profile.
double volume_divisor(const Recipe& recipe);

/// Unit of a volume after that division.
std::string volume_unit(const Recipe& recipe);

/// Distance along y, in grid spacings, from which on outlines count as endless in a profile.
inline constexpr double kFarAlongY = 50.0;

/// Checks that a layer or a pattern does not end along y, on a grid with this \p spacing.
/// \throws KeyError naming the shape to use instead.
void refuse_ends_along_y(const Layer& layer, double spacing);

/// Checks that a layer or pattern of a round wafer is round; shapes endless along y become rings.
/// \throws KeyError naming what to use instead.
void refuse_off_axis(const Layer& layer);

/// Number of levels of a recipe's grid: that of [grid], or for "auto" the most, up to 3, for which the cells
/// along both sides divide and the coarsest level has 24 along the shorter.
int grid_levels(const Recipe& recipe, const levelset::Domain& domain);

/// The spacing nearest to \p wanted, at least \p least, for which the coarsest of \p levels has whole cells,
/// at least 4, along both sides; as a recipe writes it. Spacings are tried down to the one whose coarsest
/// cells are as wide as \p wanted. Empty if none fits.
std::string spacing_for(int levels, const DomainSection& domain, double wanted, double least = 0.0);

/// Checks that the domain can have the levels of [grid].
/// \throws KeyError with a spacing that allows them.
void check_grid(const GridSection& grid, const DomainSection& domain);

}  // namespace sidewall::app
