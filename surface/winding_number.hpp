#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Winding number of a mesh around a point: 1 inside a closed body whose normals point outwards, 0 outside,
/// the sum where bodies overlap, in between near openings. Groups of triangles far away count as one dipole
/// (Barill, Dickson, Schmidt, Levin and Jacobson, ACM Transactions on Graphics 37, 2018). Queries are const
/// and may run in parallel.
class WindingNumber {
  public:
    /// Builds the tree, O(n log n).
    explicit WindingNumber(const TriangleMesh& mesh);

    /// The winding number at a point, within 0.02 of the exact one for a closed mesh. O(log n).
    double at(const Vec3& point) const;

  private:
    // A range of triangles in tree order, with the dipole that replaces them from far away.
    struct Node {
        std::uint32_t begin = 0, end = 0;  // range of triangles
        std::uint32_t skip = 0;            // index of the node after its subtree
        Vec3 middle = Vec3::Zero(), area = Vec3::Zero();
        double radius = 0.0;  // sphere around `middle` that holds them
    };
    void build(std::uint32_t begin, std::uint32_t end);

    std::vector<std::array<Vec3, 3>> triangles_;
    std::vector<Node> nodes_;  // depth first, each before its children
};

}  // namespace sidewall::surface
