#pragma once
#include <array>
#include <optional>
#include <set>
#include <string>

#include "app/pictures/picture.hpp"
#include "app/pictures/render_scene.hpp"
#include "app/results/result.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {

/// How to draw a picture.
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

/// Whether a surface is one cell wide across y, as a profile in x and z is: nearly all vertices lie on its two sides.
bool is_strip(const TriangleMesh& surface);

/// The scale that comparable pictures share: the part of space, the range of colours, the key.
struct PictureScale {
    Colouring colouring;      ///< without values
    Box3 box;                 ///< of surfaces and interfaces
    std::set<int> materials;  ///< ids that they show
    Materials table;          ///< of names and colours

    /// Extends the box and the materials to another result.
    void extend(const Result& result);
};

/// The scale of a single picture.
/// \throws RecipeError if there is no attribute of that name (the message lists those there are).
PictureScale scale_of(const Result& result, const RenderOptions& options);

/// Draws a surface by ray casting: shaded with ambient occlusion, four samples a pixel. The key has a column of
/// its own at the right.
///
/// A surface whose boundary lies on a rectangle is drawn as the solid below it, down to a little under its
/// lowest point, a closed one as the solid inside; sides and the cut show the material there, layer by layer
/// if there are interfaces. Others are drawn as sheets. A surface without the scale's attribute is grey.
/// Deterministic, parallel over tiles.
///
/// \param options  those that the scale was made with.
/// \throws RecipeError if the cut is not axis-aligned or leaves nothing.
Picture render(const Result& result, const RenderOptions& options, const PictureScale& scale);

/// Draws a surface on its own scale.
/// \throws RecipeError as the scale and the drawing.
Picture render(const Result& result, const RenderOptions& options);

/// The key of pictures on that scale.
PictureKey key_of(const PictureScale& scale);

}  // namespace sidewall::app
