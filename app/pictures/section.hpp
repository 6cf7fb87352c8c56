#pragma once
#include <vector>

#include "app/pictures/render_scene.hpp"

// What a plane shows where it cuts the layers.
namespace sidewall::app {

/// A small disc on a section.
struct SectionSample {
    Colour colour = Colour::Zero();  ///< mean of the materials there, each by its share
    double solid = 0.0;              ///< share of the disc that lies in a material
    double line = 0.0;               ///< share of the disc under the outlines between materials
    Vec3 way_out = Vec3::Zero();     ///< from its middle to just outside; zero if that is in the open
};

/// Tells materials by the layers' signed distances: each layer wraps those below it, so that of two neighbours'
/// distances the difference is the thickness of what lies between them, and the shares of a disc follow however
/// thin that is. A layer thinner than RenderScene::thin() is none. Keeps what was found last: one object a
/// thread, for points near each other.
class SectionReader {
  public:
    /// \pre the scene is solid and outlives it.
    explicit SectionReader(const RenderScene& scene);

    /// \param point  world units, in the section.
    /// \param axis   the section's normal.
    /// \param width  of the disc, above 0.
    SectionSample at(const Vec3& point, int axis, double width);

  private:
    struct Last {
        Vec3 point;
        surface::DistanceSample found;
    };

    surface::DistanceSample distance(std::size_t layer, const Vec3& point, double exact);

    const RenderScene& scene_;
    std::vector<std::optional<Last>> last_;
};

}  // namespace sidewall::app
