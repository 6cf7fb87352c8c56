#pragma once
#include "levelset/grid.hpp"

namespace sidewall::levelset {

/// Points at which to look up the material below a mesh's triangles: the mean of a triangle's corners without
/// those on edges of the surface, where materials meet; its centroid if all corners are on edges.
class FacePoints {
  public:
    explicit FacePoints(const TriangleMesh& mesh)
        : mesh_(mesh), edge_(mesh.vertex_attribute(kEdgeAttribute)) {}
    Vec3 of(std::size_t triangle) const {
        Vec3 sum = Vec3::Zero();
        int count = 0;
        for (const std::uint32_t v : mesh_.triangles[triangle])
            if (edge_ == nullptr || edge_->values[v] == 0.0) sum += mesh_.vertices[v], ++count;
        return count > 0 ? Vec3(sum / count) : triangle_centroid(mesh_, triangle);
    }

  private:
    const TriangleMesh& mesh_;
    const Attribute* edge_;
};

}  // namespace sidewall::levelset
