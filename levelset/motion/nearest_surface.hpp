#pragma once
#include <mutex>
#include <optional>
#include <span>

#include "levelset/domain.hpp"
#include "levelset/motion/cell_triangles.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A mesh on which the points nearest to nodes of a grid are searched.
class NearestSurface {
  public:
    explicit NearestSurface(const surface::RayScene& scene)
        : vertices(scene.vertices()), triangles(scene.triangles()), scene_(&scene) {}
    /// Without a hierarchy, which is made when a node has no triangle near.
    explicit NearestSurface(const TriangleMesh& mesh)
        : vertices(mesh.vertices), triangles(mesh.triangles), mesh_(&mesh) {}

    /// The point nearest to a node.
    /// \param[in,out] world  the node's place; that of its image beyond a periodic side if the surface is nearer there.
    surface::SurfaceHit closest(const CellTriangles& cells, const Domain& domain, const openvdb::Coord& node,
                                Vec3& world) const;

    const std::span<const Vec3> vertices;
    const std::span<const Triangle> triangles;

  private:
    surface::SurfaceHit near(const CellTriangles& cells, const openvdb::Coord& node, const Vec3& world,
                             double dx) const;
    void keep_nearer(std::uint32_t t, const Vec3& world, surface::SurfaceHit& best) const;

    const surface::RayScene* scene_ = nullptr;
    const TriangleMesh* mesh_ = nullptr;
    mutable std::once_flag once_;
    mutable std::optional<surface::RayScene> own_scene_;
};

}  // namespace sidewall::levelset
