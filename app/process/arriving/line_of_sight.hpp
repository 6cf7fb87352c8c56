#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Line of sight straight upwards from points outside a closed surface: the downward faces of the surface, sorted into
/// square columns and from above downwards in each. A vertical line from such a point meets one of them before any other
/// face. Built and queried in a small part of the time that a bounding volume hierarchy takes.
class ColumnSight {
  public:
    /// \param width  of the columns, length unit; about as long as the mesh's edges.
    /// \note O(n), parallel; the same answers on any number of threads.
    ColumnSight(const TriangleMesh& mesh, double width);

    /// Whether no downward face lies above \p point. Faces that stand upright are not met.
    bool open_above(const Vec3& point) const;

  private:
    struct Entry {
        std::array<float, 5> bounds;  // low x, high x, low y, high y, high z; rounded outwards
        std::uint32_t triangle;       // number in corners_
    };
    std::size_t column_along(int axis, double position) const;

    std::vector<std::array<Vec3, 3>> corners_;  // of the downward triangles
    std::array<double, 2> low_{};
    double width_;
    std::array<std::size_t, 2> count_{};
    std::vector<std::uint32_t> first_;  // column n's entries stand at first_[n] .. first_[n + 1]
    std::vector<Entry> entries_;
};

/// Whether a straight line from a surface point towards \p direction (unit, upwards) meets no surface; it is
/// mirrored or goes on periodically at the sides.
/// \pre the surface has its scene, or its columns if the direction is straight upwards.
bool in_line_of_sight(const TracedSurface& surface, const Vec3& point, const Vec3& normal,
                      const Vec3& direction, double spacing);

}  // namespace sidewall::app
