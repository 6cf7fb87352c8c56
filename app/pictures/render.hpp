#pragma once
#include <optional>
#include <string>

#include "app/pictures/picture.hpp"
#include "app/results/result.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {

struct RenderOptions {
    std::string color;  ///< attribute to colour by, or "height"; empty: material if there, else plain
    double azimuth_deg =
        25.0;  ///< 0 looks along +y; grows as the viewer walks counter-clockwise seen from above
    double elevation_deg = 30.0;        ///< above the horizon
    std::optional<surface::Plane> cut;  ///< axis-aligned; the half towards the viewer is taken away
    std::optional<std::array<double, 2>>
        range;  ///< of the colour bar; absent: the values', outliers of 0.5 % apart
    int width = 1200;
    int height = 900;
    bool edges = false;  ///< draw the triangles' edges
};

/// Draws a surface by ray casting: shaded with ambient occlusion, four samples a pixel.
///
/// A surface whose boundary lies on a rectangle is drawn as the solid below it, down to a little under its
/// lowest point, a closed one as the solid inside; sides and the cut show the material there, layer by layer
/// if there are interfaces. Others are drawn as sheets. Deterministic, parallel over tiles.
///
/// \throws RecipeError if there is no attribute of that name (the message lists those there are), or the cut
/// is not
///         axis-aligned or leaves nothing.
Picture render(const Result& result, const RenderOptions& options);

}  // namespace sidewall::app
