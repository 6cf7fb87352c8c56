#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/large_vector.hpp"
#include "surface/extraction/float_grid.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::levelset {

struct LevelColumns;
struct MaterialStack;

/// The closest surface point of a grid node next to the front.
struct SurfaceSample {
    std::uint32_t triangle = 0;  ///< of the mesh that carries fluxes
    float u = 0.0f, v = 0.0f;    ///< barycentric weights of the triangle's second and third vertex
    Eigen::Vector3i node = Eigen::Vector3i::Zero();  ///< the grid node it was found for
    Eigen::Vector3f foot = Eigen::Vector3f::Zero();  ///< from the node to the surface point; index space
};

/// The surface point of a sample, in world units.
inline Vec3 surface_point(const SurfaceSample& sample, const Domain& domain) {
    const double dx = domain.spacing;
    return {domain.min[0] + dx * (sample.node.x() + static_cast<double>(sample.foot.x())),
            domain.min[1] + dx * (sample.node.y() + static_cast<double>(sample.foot.y())),
            dx * (sample.node.z() + static_cast<double>(sample.foot.z()))};
}

class SampleIndex;  // levelset/motion/sample_index.hpp

/// The extension of surface values into the narrow band along normals: every node takes its speed from a
/// surface sample (Adalsteinsson and Sethian, J. Comput. Phys. 148 (1999) 2).
struct Extension {
    LargeVector<SurfaceSample> samples;            ///< one per node within a cell of the front, in grid order
    std::shared_ptr<const SampleIndex> sample_of;  ///< by grid node: index into samples
    /// By sample: no lower layer is near, so that the top one is bare. Empty: not determined.
    std::vector<std::uint8_t> alone;

    /// Samples x (layers - 1): depths of the lower layers (LayerDepths), world units; see find_bodies.
    std::vector<float> thickness{};
    /// By sample of a node at a body's edge, which follow all others: the body's layer; see find_bodies.
    /// kNoBody: the node moves like any other.
    std::vector<std::uint32_t> body{};
    static constexpr std::uint32_t kNoBody = 0xffffffffu;
    std::vector<std::uint32_t> nearest{};  ///< by edge node: the sample of the surface point nearest to it
    /// By edge node: its closest surface point lies on the cover's edge, so that no other front reaches it
    /// sooner. Empty: all.
    std::vector<std::uint8_t> at_cover{};
    /// By edge node: V is far smaller there than at the edge, so that the front is no arc about it. Empty:
    /// none.
    std::vector<std::uint8_t> shaded{};

    /// Number of ordinary samples, without those of nodes at a body's edge.
    std::size_t plain() const { return samples.size() - body.size(); }

    bool top_alone(std::size_t sample) const { return !alone.empty() && alone[sample] != 0; }
};

/// Finds the closest surface point of every node within a cell of the front: along the gradient, or, where
/// that misses (edges and corners), by a closest-point search. Nodes farther out share the sample of the node
/// next to their own foot point.
///
/// \param scene  the mesh that carries the fluxes, within half a cell of the front.
/// \param left_out  columns of the next finer level, over whole leaves of this one, that get no samples;
///                  null: none.
/// \note Parallel, deterministic.
Extension extend(const Grid& grid, const Domain& domain, const surface::RayScene& scene,
                 const LevelColumns* left_out = nullptr);

/// Extension of a stack's surface for speeds that depend on no flux; samples need no mesh.
///
/// \param mesh          the surface as extracted, if samples need their triangles; else nullptr.
/// \param top_is_inert  the top layer does not move: samples with no other layer near get no triangle.
Extension extend_untraced(const MaterialStack& stack, const TriangleMesh* mesh, bool top_is_inert,
                          const LevelColumns* left_out = nullptr);

/// One sample for the whole band: for a speed that is the same everywhere on the surface.
Extension extend_uniform(const Grid& grid);

}  // namespace sidewall::levelset
