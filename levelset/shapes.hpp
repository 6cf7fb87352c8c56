#pragma once
#include <array>
#include <string>
#include <vector>

#include "levelset/polygon.hpp"

namespace sidewall::levelset {

enum class ShapeKind { plane, trench, hole, fin, box, mesh, mask };

/// The body of one material layer. Lengths in world units, angles in degrees. A layer is always united with
/// all layers below it, so a hole in a mask ends on the layer below however deep it is.
struct Shape {
    ShapeKind kind = ShapeKind::plane;
    double top = 0.0;                      ///< z of the flat surface the shape is cut from or stands on
    std::array<double, 2> position{0, 0};  ///< centre of the trench, hole, fin or box (x, y)
    double width = 0.0;                    ///< trench, fin: x width at z = top (fin: at its foot)
    double radius = 0.0;                   ///< hole: radius at z = top
    double depth = 0.0;                    ///< trench, hole: from top downwards; infinite = through the layer
    double height = 0.0;                   ///< fin, box: above top
    std::array<double, 2> size{0, 0};      ///< box: x, y lengths at its foot
    double taper_deg =
        0.0;  ///< walls from the vertical; positive narrows trench, hole (downwards), fin, box (upwards)
    std::vector<Polygon> polygons;  ///< mask: in x and y
    bool openings = true;           ///< mask: they are open, down to the layer below; else all but they is
    std::string file;               ///< mesh: closed or open surface file, same length unit
};

}  // namespace sidewall::levelset
