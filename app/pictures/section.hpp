#pragma once
#include <vector>

#include "app/pictures/render_scene.hpp"

// Sections: materials in a plane that cuts the layers.
namespace sidewall::app {

/// Materials on a small disc of a section.
struct SectionSample {
    Colour colour = Colour::Zero();  ///< mean of the materials there, each by its share
    double solid = 0.0;              ///< share of the disc that lies in a material
    double line = 0.0;               ///< share of the disc under the outlines between materials
    Vec3 way_out = Vec3::Zero();     ///< from its middle to just outside; zero if that is in the open
};

/// Finds the materials of a section from the layers' signed distances. Each layer wraps those below it, so the
/// difference of neighbours' distances is a film's thickness, and shares of a disc follow however thin the film is.
/// Layers thinner than RenderScene::thin() count as none. Remembers the last distances: use one object a thread, for
/// points near each other.
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
