#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Tests the vertical line of sight from points outside a closed surface. Its downward faces are sorted into
/// square columns, and by falling height in each: a line upwards from such a point meets one of them before
/// any other face. Much faster to build and query than a bounding volume hierarchy.
class ColumnSight {
  public:
    /// \param width  of the columns, in length units; about the mesh's edge length.
    /// \note O(n), parallel, deterministic.
    ColumnSight(const TriangleMesh& mesh, double width);

    /// Whether no downward face lies above \p point. Vertical faces are ignored.
    bool open_above(const Vec3& point) const;

  private:
    struct Entry {
        std::array<float, 5> bounds;  // low x, high x, low y, high y, high z; rounded outwards
        std::uint32_t triangle;       // index into corners_
    };
    std::size_t column_along(int axis, double position) const;

    std::vector<std::array<Vec3, 3>> corners_;  // of the downward triangles
    std::array<double, 2> low_{};
    double width_;
    std::array<std::size_t, 2> count_{};
    std::vector<std::uint32_t> first_;  // entries of column n: first_[n] up to first_[n + 1]
    std::vector<Entry> entries_;
};

/// Whether a straight line from a surface point along \p direction (unit, upwards) meets no surface. Lateral
/// sides mirror it or continue it periodically.
/// \pre the surface has its scene, or its columns if \p direction is vertical.
bool in_line_of_sight(const TracedSurface& surface, const Vec3& point, const Vec3& normal,
                      const Vec3& direction, double spacing);

/// Whether the line from a grid node at or inside the front along \p direction leads within a cell from its
/// layer into one that is etched at less than half of its rate, such as a mask. The node is in that layer's
/// shadow, even if the surface point nearest to it is the layer's lit edge.
/// \param rates  of etching by layer.
bool enters_slower_layer(const levelset::MaterialStack& stack, std::span<const double> rates,
                         const Vec3& node, const Vec3& direction);

}  // namespace sidewall::app
