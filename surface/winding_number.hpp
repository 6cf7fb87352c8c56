#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// How often a mesh winds around a point: 1 inside a closed body whose normals point outwards, 0 outside, the sum of the bodies
/// where several overlap; in between near openings. Triangles far away count as one in their middle (Barill, Dickson, Schmidt,
/// Levin and Jacobson, ACM Transactions on Graphics 37, 2018). Queries are const and may run in parallel.
class WindingNumber {
  public:
    /// O(n log n).
    explicit WindingNumber(const TriangleMesh& mesh);

    /// Within 0.02 of the exact one for a closed mesh. O(log n).
    double at(const Vec3& point) const;

  private:
    // Triangles of the tree's order, and what they are from far away.
    struct Node {
        std::uint32_t begin = 0, end = 0;  // triangles
        std::uint32_t skip = 0;            // the node after its children
        Vec3 middle = Vec3::Zero(), area = Vec3::Zero();
        double radius = 0.0;  // around the middle
    };
    void build(std::uint32_t begin, std::uint32_t end);

    std::vector<std::array<Vec3, 3>> triangles_;
    std::vector<Node> nodes_;  // each before its children
};

}  // namespace sidewall::surface
