#pragma once
#include <array>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "app/pictures/picture.hpp"
#include "app/results/result.hpp"
#include "surface/distance.hpp"

// The scene that render() draws: meshes with their colours and normals.
namespace sidewall::app {

/// A layer: the boundary between its material and what lies above.
struct RenderLayer {
    const TriangleMesh* mesh;
    surface::SignedDistance distance;
    std::vector<int> material;  ///< of each triangle, -1 if it says none
    std::optional<int> body;    ///< the layer's material; none where it varies over the boundary
};

/// How the surface is coloured: by a scalar, or by material.
struct Colouring {
    bool scalar = false;
    std::string attribute;       ///< by whose values, or "height"
    std::vector<double> values;  ///< per vertex or per triangle
    bool per_vertex = false;
    double low = 0.0, high = 1.0;
    std::string title;  ///< with its unit
};

/// The colours of an attribute; nothing if the surface has none of that name.
std::optional<Colouring> find_colouring(const Result& result, const std::string& name,
                                        const std::optional<std::array<double, 2>>& range);

/// The colours of an attribute.
/// \throws RecipeError if the surface has none of that name.
Colouring choose_colouring(const Result& result, const std::string& name,
                           const std::optional<std::array<double, 2>>& range);

/// The material of an id; one called "material 7" if the table ends before it.
Material material_of(int id, const Materials& materials);

/// Material of each triangle, -1 where the mesh says none.
std::vector<int> triangle_materials(const TriangleMesh& mesh);

/// Ends of a colour bar: the lowest and highest finite value but for half a percent at either end, and 0 where the
/// lowest is near it.
std::array<double, 2> usual_range(std::vector<double> values);

/// Grid spacing that a mesh was extracted on: marching cubes makes about two triangles a cell.
double cell_size(const TriangleMesh& mesh);

/// Material between the surface and the uppermost interface: nothing where they coincide everywhere, or where the
/// surface shows several materials without an interface.
std::optional<int> uppermost_material(const Result& result);

/// Material ids on a surface and its interfaces.
std::set<int> materials_on(const Result& result);

/// Names and colours of materials by id; those without an id are left out.
std::vector<LegendEntry> legend(const std::set<int>& ids, const Materials& materials);

/// The layers of a result, ready for ray casting.
class RenderScene {
  public:
    /// \pre the result outlives it.
    RenderScene(const Result& result, Colouring colouring);

    /// Interfaces bottom up, then the surface.
    std::span<const RenderLayer> layers() const { return layers_; }
    const TriangleMesh& surface() const { return *layers_.back().mesh; }
    const surface::RayScene& rays() const { return layers_.back().distance.scene(); }
    const Colouring& colouring() const { return colouring_; }
    bool solid() const { return solid_; }

    /// Thickness below which a layer counts as none, as in the run (levelset/layers/stack.hpp, kExposed); 0 where
    /// there is only the surface.
    double thin() const { return thin_; }

    /// Colour of the surface at a hit.
    Colour surface_colour(const surface::SurfaceHit& hit) const;

    /// Normal at a hit, interpolated across smooth edges and kept sharp across creases.
    Vec3 surface_normal(const surface::SurfaceHit& hit) const;

    /// Colour of a layer's material, at \p nearest where it varies.
    Colour layer_colour(std::size_t layer, const surface::SurfaceHit& nearest) const;

  private:
    std::vector<RenderLayer> layers_;
    Colouring colouring_;
    Materials materials_;
    bool solid_ = false;
    double thin_ = 0.0;
    std::vector<std::array<Eigen::Vector3f, 3>> normals_;  ///< per corner of the surface
};

// Sections: materials in a plane that cuts the layers.
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
