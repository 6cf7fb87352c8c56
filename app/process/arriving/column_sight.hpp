#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Whether the sky stands open straight above points outside a closed surface: its faces that look down, sorted into square
/// columns and from above downwards in each. A vertical line from such a point meets one of them before any other. For
/// vertical lines alone, and there made and asked in a small part of the time that a hierarchy takes.
class ColumnSight {
  public:
    /// \param width  of the columns, length unit; about as long as the mesh's edges.
    /// \note O(n), parallel; the same answers on any number of threads.
    ColumnSight(const TriangleMesh& mesh, double width);

    /// Whether no face that looks down lies above \p point. Faces that stand upright are not met.
    bool open_above(const Vec3& point) const;

  private:
    struct Entry {
        std::array<float, 5> bounds;  // low x, high x, low y, high y, high z; rounded outwards
        std::uint32_t triangle;       // number in corners_
    };
    std::size_t column_along(int axis, double position) const;

    std::vector<std::array<Vec3, 3>> corners_;  // of the triangles that look down
    std::array<double, 2> low_{};
    double width_;
    std::array<std::size_t, 2> count_{};
    std::vector<std::uint32_t> first_;  // column n's entries stand at first_[n] .. first_[n + 1]
    std::vector<Entry> entries_;
};

}  // namespace sidewall::app
