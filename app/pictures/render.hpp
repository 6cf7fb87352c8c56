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
    std::string color;  ///< attribute to colour by, or "height"; empty: material if present, else plain
    double azimuth_deg =
        25.0;  ///< 0 looks along +y; grows as the viewer walks counter-clockwise seen from above
    double elevation_deg = 30.0;        ///< above the horizon
    std::optional<surface::Plane> cut;  ///< axis-aligned plane; the half towards the viewer is removed
    std::optional<std::array<double, 2>>
        range;  ///< range of the colour bar; absent: that of the values but 0.5 % at either end
    int width = 1200;
    int height = 900;
    bool edges = false;  ///< draw the triangles' edges
};

/// Whether a surface is one cell wide along y, as a profile is: nearly all vertices lie on its two sides.
bool is_strip(const TriangleMesh& surface);

/// What comparable pictures share: the part of space, the range of colours, the key.
struct PictureScale {
    Colouring colouring;      ///< without the values per vertex or triangle
    Box3 box;                 ///< bounds of the surfaces, down to the lowest interface
    std::set<int> materials;  ///< ids on surfaces and interfaces
    Materials table;          ///< names and colours by id

    /// Extends the box and the materials by those of another result.
    void extend(const Result& result);
};

/// The scale of a single picture.
/// \throws RecipeError if there is no attribute of that name (the message lists the ones there are).
PictureScale scale_of(const Result& result, const RenderOptions& options);

/// Draws a surface by ray casting: shaded with ambient occlusion, four samples a pixel, the key in a column
/// at the right. Deterministic, parallel over tiles.
///
/// An open surface whose boundary lies on a rectangle is drawn as the solid below it, down to a little under
/// its lowest point, and a closed one as the solid inside. Sides and cut of a solid show its materials, layer
/// by layer if there are interfaces. Other surfaces are drawn as sheets. A surface without the attribute of
/// the scale is grey.
///
/// \param options  the ones that the scale was made with.
/// \throws RecipeError if the cut is not axis-aligned or leaves nothing.
Picture render(const Result& result, const RenderOptions& options, const PictureScale& scale);

/// Draws a surface on its own scale.
/// \throws RecipeError as scale_of() and the other render().
Picture render(const Result& result, const RenderOptions& options);

/// The key of pictures on that scale.
PictureKey key_of(const PictureScale& scale);

}  // namespace sidewall::app
