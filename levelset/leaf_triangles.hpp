#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::levelset {

/// A point in dx; the fourth component is 0 and fills the register.
using IndexPoint = Eigen::Vector4f;

/// A mesh in index space.
struct IndexMesh {
    std::vector<IndexPoint> vertices;
    std::span<const Triangle> triangles;  ///< of the mesh it was made from
};
IndexMesh to_index_space(const Domain& domain, std::span<const Vec3> vertices,
                         std::span<const Triangle> triangles);

/// Which triangles come near each leaf of a grid, as one list a leaf.
struct LeafTriangles {
    std::vector<std::uint32_t> first;     ///< leaf n's triangles stand at first[n] .. first[n + 1]
    std::vector<std::uint32_t> triangle;  ///< in no particular order within a leaf

    std::span<const std::uint32_t> of(std::size_t leaf) const {
        return std::span(triangle).subspan(first[leaf], first[leaf + 1] - first[leaf]);
    }
};

/// Lists, for every leaf, the triangles whose bounding box comes within \p reach (in dx) of its nodes.
/// Parallel; O(triangles + leaves).
LeafTriangles bin_by_leaf(const std::vector<const Leaf*>& leaves, const IndexMesh& mesh, float reach);

/// The triangles around one leaf, by the grid cells they pass through: finds what a short ray from a node
/// hits by a handful of tests, where a search through a hierarchy over the whole mesh costs ten times as
/// much.
class LeafCells {
  public:
    /// How far beyond the leaf's nodes a foot point may lie, in dx.
    static constexpr float kReach = 1.2f;
    /// A hit counts this near to the expected foot point, in dx.
    static constexpr float kSlack = 0.25f;

    /// What a ray met, near to its expected foot point.
    struct Hit {
        std::uint32_t triangle;
        float u, v;  ///< barycentric weights of the triangle's second and third vertex
        explicit operator bool() const { return triangle != surface::kNoTriangle; }
    };

    /// Sorts \p candidates into the cells around the leaf at \p origin.
    void fill(const openvdb::Coord& origin, const IndexMesh& mesh, std::span<const std::uint32_t> candidates);

    /// The hit nearest to \p node + \p distance * \p direction (all in dx, relative to the leaf's origin)
    /// along that line, within kSlack, those in that point's own cell first; of equals, that of the lowest
    /// triangle.
    Hit nearest_hit(const Vec3& node, const Vec3& direction, double distance) const;

    /// Calls use(triangle) for those that pass through one of the eight cells around a node of the leaf; some more than
    /// once.
    template <class Use>
    void each_around(int x, int y, int z, Use&& use) const {
        for (int n = 0; n < 8; ++n)
            for (std::int32_t e = head_[cell(x - (n & 1), y - (n >> 1 & 1), z - (n >> 2))]; e >= 0;
                 e = entries_[static_cast<std::size_t>(e)].next)
                use(locals_[static_cast<std::size_t>(entries_[static_cast<std::size_t>(e)].local)].triangle);
    }

  private:
    static constexpr int kSide = 12, kMargin = 2;  // cells -2 .. 9
    struct LocalTriangle {
        IndexPoint corner, edge1, edge2;  // relative to the leaf's origin
        std::uint32_t triangle;
    };
    struct Entry {
        std::int32_t next, local;
    };
    static std::size_t cell(int x, int y, int z) {
        return static_cast<std::size_t>(((x + kMargin) * kSide + y + kMargin) * kSide + z + kMargin);
    }
    void search(std::size_t cell, const IndexPoint& foot, const IndexPoint& direction, float& nearest,
                Hit& best) const;

    std::array<std::int32_t, kSide * kSide * kSide> head_;
    std::vector<LocalTriangle> locals_;
    std::vector<Entry> entries_;
};

}  // namespace sidewall::levelset
