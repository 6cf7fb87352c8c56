#pragma once
#include <optional>
#include <span>
#include <vector>

#include "levelset/shapes/polygon.hpp"

// Unions of polygons and outlines of paths, computed by the library Clipper.
namespace sidewall::levelset {

/// The union of \p polygons as outlines that neither cross nor overlap: each outer one, counter-clockwise, is
/// followed by its holes, clockwise. A polygon that crosses itself counts by the even-odd rule. Corners are
/// rounded to 2^-50 of the farthest coordinate.
/// \throws GeometryError for corners that are not finite, and if the crossings of edges would take minutes.
std::vector<Polygon> united(std::span<const Polygon> polygons);

/// A point near which a polygon crosses itself, if it does. Edges that touch, or overlap by less than 1e-9 of
/// the polygon's size, do not cross.
/// \throws GeometryError as united().
std::optional<std::array<double, 2>> self_crossing(const Polygon& polygon);

/// The area of a polygon, positive if its corners run counter-clockwise.
double signed_area(const Polygon& polygon);

/// The area of outlines as united() gives them.
double area_of(std::span<const Polygon> outlines);

/// How a path is drawn about its points, as layouts write it.
struct PathStyle {
    double half_width = 0.0;
    double begin = 0.0,
           end = 0.0;    ///< lengths beyond the first and the last point; negative: the path ends before
    bool round = false;  ///< half discs at both ends instead
};

/// Polygons whose union is the area of a path as KLayout draws it: bends of up to 90 degrees are mitred,
/// sharper ones cut off half a width ahead of the bend. A path of one point is a rectangle along x, or a
/// disc. Round ends err by up to a thousandth of their radius. A path without width or length gives none.
/// \throws GeometryError as united().
std::vector<Polygon> path_polygons(const Polygon& points, const PathStyle& style);

}  // namespace sidewall::levelset
