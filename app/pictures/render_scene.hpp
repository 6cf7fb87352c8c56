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

// The scene that render() draws: meshes with their colours and normals, and sections through them.
namespace sidewall::app {

/// A layer: the boundary between its material and what lies above.
struct RenderLayer {
    const TriangleMesh* mesh;
    surface::SignedDistance distance;
    std::vector<int> material;  ///< id per triangle, -1 where unknown
    std::optional<int> body;    ///< the layer's material; none where it varies over the boundary
};

/// How the surface is coloured: by a scalar, or by material.
struct Colouring {
    bool scalar = false;
    std::string attribute;       ///< name of the attribute, or "height"
    std::vector<double> values;  ///< per vertex or per triangle
    bool per_vertex = false;
    double low = 0.0, high = 1.0;
    std::string title;  ///< attribute with its unit
};

/// Colouring by an attribute over \p range, or over the usual_range() of its values; nothing if the surface
/// has none of that name.
std::optional<Colouring> find_colouring(const Result& result, const std::string& name,
                                        const std::optional<std::array<double, 2>>& range);

/// find_colouring() for an attribute that must exist.
/// \throws RecipeError if the surface has none of that name.
Colouring choose_colouring(const Result& result, const std::string& name,
                           const std::optional<std::array<double, 2>>& range);

/// The material of an id; a placeholder called "material 7" if the table ends before it.
Material material_of(int id, const Materials& materials);

/// Material id of each triangle, -1 where the mesh has none.
std::vector<int> triangle_materials(const TriangleMesh& mesh);

/// Ends of a colour bar: the 0.5 % and 99.5 % quantiles of the finite values. A positive lower end of less
/// than a tenth of the upper one becomes 0.
std::array<double, 2> usual_range(std::vector<double> values);

/// Estimated grid spacing of a mesh: marching cubes makes about two triangles per cell.
double cell_size(const TriangleMesh& mesh);

/// Material between the surface and the uppermost interface; nothing where they coincide everywhere, or where
/// the surface shows several materials without an interface.
std::optional<int> uppermost_material(const Result& result);

/// Material ids on a surface and its interfaces.
std::set<int> materials_on(const Result& result);

/// Legend entries of material ids, without the id -1 (unknown).
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

    /// Thickness below which a layer counts as none, as in the run (levelset/layers/stack.hpp, kExposed); 0
    /// if there is only the surface. World units.
    double thin() const { return thin_; }

    /// Colour of the surface at a hit.
    Colour surface_colour(const surface::SurfaceHit& hit) const;

    /// Normal at a hit, interpolated across smooth edges and kept sharp across creases.
    Vec3 surface_normal(const surface::SurfaceHit& hit) const;

    /// Colour of a layer's material; where it varies, of that at \p nearest.
    Colour layer_colour(std::size_t layer, const surface::SurfaceHit& nearest) const;

  private:
    std::vector<RenderLayer> layers_;
    Colouring colouring_;
    Materials materials_;
    bool solid_ = false;
    double thin_ = 0.0;
    std::vector<std::array<Eigen::Vector3f, 3>> normals_;  ///< per corner of each triangle
};

/// Mean over a small disc of a section, a plane that cuts the layers.
struct SectionSample {
    Colour colour = Colour::Zero();  ///< mean colour of the materials, weighted by share
    double solid = 0.0;              ///< share of the disc that lies in a material
    double line = 0.0;               ///< share of the disc under outlines between materials
    Vec3 offset_to_outside =
        Vec3::Zero();  ///< from the disc's centre to just outside the solid; 0 if that is outside
};

/// Finds the materials in a section from signed distances to the layers. Each layer wraps those below it. The
/// difference of two neighbours' distances is therefore a film's thickness, and a film's share of a disc is
/// found however thin the film is. Layers thinner than RenderScene::thin() count as none. The last distances
/// are cached: use one object per thread, for points close to each other.
class SectionReader {
  public:
    /// \pre the scene is solid and outlives it.
    explicit SectionReader(const RenderScene& scene);

    /// \param point  world units, in the section.
    /// \param axis   axis of the section's normal.
    /// \param width  diameter of the disc, above 0.
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
