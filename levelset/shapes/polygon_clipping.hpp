#pragma once
#include <optional>
#include <span>
#include <vector>

#include "levelset/shapes/polygon.hpp"

// Unions of polygons and outlines of paths, made by the library Clipper.
namespace sidewall::levelset {

/// The union of \p polygons as outlines that neither cross nor overlap: each outer one, counter-clockwise, is followed by
/// its holes, clockwise. A polygon that crosses itself is where it goes round an odd number of times. Corners are rounded
/// to 2^-50 of the farthest coordinate.
/// \throws GeometryError for corners that are not finite, and for so many edges across one another that it would take minutes.
std::vector<Polygon> united(std::span<const Polygon> polygons);

/// A point near which a polygon crosses itself, if it does. Edges that touch do not cross, nor do they by less than
/// 1e-9 of its size.
/// \throws GeometryError as united().
std::optional<std::array<double, 2>> self_crossing(const Polygon& polygon);

/// The area of a polygon, positive if it goes round counter-clockwise.
double signed_area(const Polygon& polygon);

/// The area of outlines as united() gives them.
double area_of(std::span<const Polygon> outlines);

/// How a path is drawn about its points, as layouts write it.
struct PathStyle {
    double half_width = 0.0;
    double begin = 0.0,
           end = 0.0;    ///< how far it reaches beyond its first and last point; negative: ends before
    bool round = false;  ///< ends in half discs, instead
};

/// Polygons whose union is the area of a path as KLayout draws it: bends of up to 90 degrees are mitred, and
/// sharper ones cut off half a width ahead of the bend. A path of one point is a rectangle along x, or a disc; round ends
/// are within a thousandth of their radius. Without width or length there is none.
/// \throws GeometryError as united().
std::vector<Polygon> path_polygons(const Polygon& points, const PathStyle& style);

}  // namespace sidewall::levelset
