#pragma once
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "levelset/shapes/polygon.hpp"

namespace sidewall::levelset {

enum class ShapeKind { plane, trench, hole, fin, box, mesh, mask, sphere, cylinder, gap, profile };

/// The body of one material layer. Lengths in world units, angles in degrees. A layer is always united with
/// all layers below it, so a hole in a mask ends on the layer below however deep it is.
struct Shape {
    ShapeKind kind = ShapeKind::plane;
    double top = 0.0;                      ///< z of the flat surface the shape is cut from or stands on
    std::array<double, 2> position{0, 0};  ///< centre of the trench, hole, fin or box (x, y)
    double width = 0.0;                ///< trench, fin: x width at z = top (fin: at its foot); gap: along y
    double radius = 0.0;               ///< hole: radius at z = top; sphere, cylinder; box: of rounded edges
    double depth = 0.0;                ///< trench, hole: from top downwards; infinite = through the layer
    double height = 0.0;               ///< fin, box: above top; gap: along z
    std::array<double, 2> size{0, 0};  ///< box: x, y lengths at its foot
    double taper_deg =
        0.0;  ///< walls from the vertical; positive narrows trench, hole (downwards), fin, box (upwards)
    std::vector<Polygon> polygons;  ///< mask: in x and y
    bool contours = false;          ///< mask: polygons are resist_contours(), continued beyond the domain
    bool openings = true;  ///< mask, outline(): polygons are open down to the layer below; else all but them
    std::string file;      ///< mesh: closed or open surface file, same length unit

    bool subtract = false;  ///< cut out of all layers below instead of added (see make_body)
    double base = -std::numeric_limits<double>::infinity();   ///< mask: z of its underside, if it has one
    double centre_z = 0.0;                                    ///< sphere, cylinder, gap
    double length = std::numeric_limits<double>::infinity();  ///< cylinder: along its axis; gap: along x
    int axis = 2;                                             ///< cylinder: 0, 1, 2 for x, y, z
    Polygon profile;  ///< profile: x and z; closed if its last point is its first, else material lies below
    bool revolved = true;  ///< profile: about the vertical axis at position; else extruded along y
};

}  // namespace sidewall::levelset
