#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/pictures/colour.hpp"
#include "app/pictures/picture.hpp"
#include "app/results/result.hpp"
#include "surface/ray_scene.hpp"

// What render() draws: meshes, their colours and normals, no pixels.
namespace sidewall::app {

/// A mesh with its hierarchy and the material of each triangle, -1 if it says none.
struct RenderLayer {
    const TriangleMesh* mesh;
    surface::RayScene scene;
    std::vector<int> material;
};

/// How the surface is coloured: by a scalar, or by material.
struct Colouring {
    bool scalar = false;
    std::vector<double> values;  ///< per vertex or per triangle
    bool per_vertex = false;
    double low = 0.0, high = 1.0;
    std::string title;  ///< with its unit
};

/// \throws RecipeError if the surface has no such attribute.
Colouring choose_colouring(const Result& result, const std::string& name,
                           const std::optional<std::array<double, 2>>& range);

class RenderScene {
  public:
    RenderScene(const Result& result, Colouring colouring);

    const RenderLayer& top() const { return layers_.back(); }
    const Colouring& colouring() const { return colouring_; }
    bool solid() const { return solid_; }

    /// Colour of the surface at a hit.
    Colour surface_colour(const surface::SurfaceHit& hit) const;

    /// Normal at a hit, interpolated across smooth edges and kept sharp across creases.
    Vec3 surface_normal(const surface::SurfaceHit& hit) const;

    /// Whether a point lies in the material, and of which colour; nothing in the open.
    std::optional<Colour> inside_colour(const Vec3& point) const;

    /// Materials on the surface and its interfaces, by id.
    std::vector<LegendEntry> legend() const;

  private:
    Colour material_colour(int id) const;

    std::vector<RenderLayer> layers_;  ///< interfaces bottom up, then the surface
    Colouring colouring_;
    Materials materials_;
    bool solid_ = false;
    std::vector<std::array<Eigen::Vector3f, 3>> normals_;  ///< per corner of the surface
};

}  // namespace sidewall::app
