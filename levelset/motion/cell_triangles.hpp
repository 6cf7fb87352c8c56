#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/large_vector.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A point in dx; the fourth component is 0 and fills the register.
using IndexPoint = Eigen::Vector4f;

/// Periodic images of a node that lies next to periodic sides, from which the surface beyond is seen. Along
/// an axis of one or two cells the surface does not change, and there are none.
std::vector<openvdb::Coord> images_beside(const Domain& domain, const openvdb::Coord& node);

/// A mesh's triangles sorted by the cells of a grid's leaves that they pass through. A short ray from a node
/// takes a handful of tests; a search in a hierarchy over the whole mesh costs ten times as much.
class CellTriangles {
  public:
    /// Largest distance of a hit from the expected foot point, in dx.
    static constexpr float kSlack = 0.25f;

    /// A hit of a ray near its expected foot point.
    struct Hit {
        std::uint32_t triangle;
        float u, v;  ///< barycentric weights of the triangle's second and third vertex
        explicit operator bool() const { return triangle != surface::kNoTriangle; }
    };

    /// Sorts triangles into the cells whose low corner is a node of a leaf. Parallel; O(triangles + leaves).
    CellTriangles(const std::vector<const Leaf*>& leaves, const Domain& domain,
                  std::span<const Vec3> vertices, std::span<const Triangle> triangles);

    /// The hit on the line from \p node along \p direction that is nearest to the point at \p distance (dx)
    /// on it, within kSlack; first in the point's own cell. Ties go to the triangle that faces upwards most.
    Hit nearest_hit(const openvdb::Coord& node, const Vec3& direction, double distance) const;

    /// Calls use(triangle) for those that pass through the eight cells around a node; some more than once.
    template <class Use>
    void each_around(const openvdb::Coord& node, Use&& use) const {
        for (int n = 0; n < 8; ++n)
            for (const std::uint32_t t : in_cell(node.offsetBy(-(n & 1), -(n >> 1 & 1), -(n >> 2)))) use(t);
    }

    /// Calls use(triangle) for all triangles in leaves with cells within \p reach cells of a node.
    template <class Use>
    void each_in_leaves(const openvdb::Coord& node, int reach, Use&& use) const {
        for (int x = (node.x() - reach) >> 3; x <= (node.x() + reach) >> 3; ++x)
            for (int y = (node.y() - reach) >> 3; y <= (node.y() + reach) >> 3; ++y)
                for (int z = (node.z() - reach) >> 3; z <= (node.z() + reach) >> 3; ++z) {
                    const std::int32_t leaf = table_.find(x, y, z);
                    if (leaf < 0) continue;
                    const auto n = static_cast<std::size_t>(leaf);
                    for (std::uint32_t e = first_[n]; e < first_[n + 1]; ++e) use(entry_[e]);
                }
    }

    /// The numbers of the leaves by their place.
    const surface::LeafTable& table() const { return table_; }

  private:
    // The cells of a leaf that have entries: bit 8 y + z of word x.
    struct Occupied {
        std::array<std::uint64_t, 8> cell{};
        std::array<std::uint16_t, 8> before{};  // bits in the words before
    };
    // A triangle in one cell of a leaf.
    struct Place {
        std::uint32_t cell, triangle;
    };

    void sort(std::size_t leaf, std::span<const Place> places);
    std::span<const std::uint32_t> in_cell(const openvdb::Coord& cell) const {
        const std::int32_t leaf = table_.find(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
        if (leaf < 0) return {};
        const auto n = static_cast<std::size_t>(leaf), x = static_cast<std::size_t>(cell.x() & 7);
        const Occupied& in = occupied_[n];
        const std::uint64_t bit = std::uint64_t{1} << ((cell.y() & 7) << 3 | (cell.z() & 7));
        if ((in.cell[x] & bit) == 0) return {};
        const auto rank = in.before[x] + static_cast<std::size_t>(std::popcount(in.cell[x] & (bit - 1)));
        const std::uint32_t* start = &start_[first_[n] + n + rank];
        return std::span(entry_).subspan(start[0], start[1] - start[0]);
    }
    void search(const openvdb::Coord& cell, const IndexPoint& shift, const IndexPoint& foot,
                const IndexPoint& direction, float& nearest, Hit& best) const;

    LargeVector<IndexPoint> vertices_;
    std::span<const Triangle> triangles_;
    surface::LeafTable table_;
    std::vector<std::uint32_t> first_;  // leaf n's entries stand at first_[n] .. first_[n + 1]
    std::vector<Occupied> occupied_;
    // First entry of each occupied cell, and after a leaf's last cell the end of its entries. The part of
    // leaf n begins at first_[n] + n.
    LargeVector<std::uint32_t> start_;
    LargeVector<std::uint32_t> entry_;  // triangles, the lowest of a cell first
};

/// Finds the points of a mesh nearest to grid nodes.
class NearestSurface {
  public:
    explicit NearestSurface(const surface::RayScene& scene)
        : vertices(scene.vertices()), triangles(scene.triangles()), scene_(&scene) {}
    /// Builds no hierarchy until a node has no triangle near.
    explicit NearestSurface(const TriangleMesh& mesh)
        : vertices(mesh.vertices), triangles(mesh.triangles), mesh_(&mesh) {}

    /// The point nearest to a node.
    /// \param[in,out] world  the node's place; set to that of an image if the surface is nearer there.
    surface::SurfaceHit closest(const CellTriangles& cells, const Domain& domain, const openvdb::Coord& node,
                                Vec3& world) const;

    const std::span<const Vec3> vertices;
    const std::span<const Triangle> triangles;

  private:
    surface::SurfaceHit near(const CellTriangles& cells, const openvdb::Coord& node, const Vec3& world,
                             double dx) const;
    bool is_nearer(const surface::SurfaceHit& hit, const surface::SurfaceHit& best, double dx) const;

    const surface::RayScene* scene_ = nullptr;
    const TriangleMesh* mesh_ = nullptr;
    mutable std::once_flag once_;
    mutable std::optional<surface::RayScene> own_scene_;
};

}  // namespace sidewall::levelset
