#include "app/process/arriving/line_of_sight.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "flux/tracer/flight.hpp"
#include "levelset/grid.hpp"

namespace sidewall::app {
namespace {

float below(double x) {
    return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity());
}

float above(double x) {
    return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

// Twice the signed area of a, b, p seen from above.
double turn(const Vec3& a, const Vec3& b, const Vec3& p) {
    return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

// Whether a downward triangle lies above the point. Edges belong to both triangles: no point slips through.
bool covers(const std::array<Vec3, 3>& t, const Vec3& p) {
    const double u = turn(t[1], t[2], p), v = turn(t[2], t[0], p), w = turn(t[0], t[1], p);
    const bool within = u <= 0.0 && v <= 0.0 && w <= 0.0;
    const double area = u + v + w;
    if (!within || area == 0.0) return false;
    return (u * t[0].z() + v * t[1].z() + w * t[2].z()) / area > p.z();
}

// The triangles whose normal points down.
std::vector<std::array<Vec3, 3>> downward_faces(const TriangleMesh& mesh) {
    constexpr std::size_t kGrain = 1024;
    std::vector<std::vector<std::array<Vec3, 3>>> parts((mesh.triangles.size() + kGrain - 1) / kGrain);
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
        const std::size_t end = std::min(mesh.triangles.size(), (part + 1) * kGrain);
        for (std::size_t t = part * kGrain; t < end; ++t) {
            const auto [a, b, c] = mesh.triangles[t];
            if (turn(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) < 0.0)
                parts[part].push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
        }
    });
    std::vector<std::array<Vec3, 3>> corners;
    for (const auto& part : parts) corners.insert(corners.end(), part.begin(), part.end());
    return corners;
}

}  // namespace

std::size_t ColumnSight::column_along(int axis, double position) const {
    const auto a = static_cast<std::size_t>(axis);
    const double column = std::floor((position - low_[a]) / width_);
    return static_cast<std::size_t>(std::clamp(column, 0.0, static_cast<double>(count_[a] - 1)));
}

ColumnSight::ColumnSight(const TriangleMesh& mesh, double width) : width_(width) {
    const Box3 box = bounding_box(mesh);
    for (int axis = 0; axis < 2; ++axis) {
        // Most columns along an axis, so that their table stays small beside the mesh.
        constexpr double kMost = 4096.0;
        const auto a = static_cast<std::size_t>(axis);
        low_[a] = box.min[axis];
        width_ = std::max(width_, (box.max[axis] - box.min[axis]) / kMost);
    }
    for (int axis = 0; axis < 2; ++axis)
        count_[static_cast<std::size_t>(axis)] =
            1 + static_cast<std::size_t>((box.max[axis] - box.min[axis]) / width_);

    const std::size_t columns = count_[0] * count_[1];
    corners_ = downward_faces(mesh);
    std::vector<std::atomic<std::uint32_t>> next(columns +
                                                 1);  // by column: its count, then its next free entry
    const auto each = [&](auto&& use) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, corners_.size(), 1024), [&](const auto& range) {
            for (std::size_t t = range.begin(); t != range.end(); ++t) {
                const auto& [a, b, c] = corners_[t];
                const Vec3 low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
                const std::size_t last_i = column_along(0, high.x()), first_j = column_along(1, low.y()),
                                  last_j = column_along(1, high.y());
                for (std::size_t i = column_along(0, low.x()); i <= last_i; ++i)
                    for (std::size_t j = first_j; j <= last_j; ++j) {
                        const std::size_t column = i * count_[1] + j;
                        use(next[column].fetch_add(1, std::memory_order_relaxed), t, low, high);
                    }
            }
        });
    };
    each([](std::uint32_t, std::size_t, const Vec3&, const Vec3&) {});
    first_.assign(columns + 1, 0);
    for (std::size_t n = 0; n < columns; ++n) {
        first_[n + 1] = first_[n] + next[n].load(std::memory_order_relaxed);
        next[n].store(first_[n], std::memory_order_relaxed);
    }
    entries_.resize(first_.back());
    each([&](std::uint32_t at, std::size_t t, const Vec3& low, const Vec3& high) {
        entries_[at] = {{below(low.x()), above(high.x()), below(low.y()), above(high.y()), above(high.z())},
                        static_cast<std::uint32_t>(t)};
    });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, columns, 64), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            std::sort(entries_.begin() + first_[n], entries_.begin() + first_[n + 1],
                      [](const Entry& a, const Entry& b) { return a.bounds[4] > b.bounds[4]; });
    });
}

bool ColumnSight::open_above(const Vec3& point) const {
    const std::size_t column = column_along(0, point.x()) * count_[1] + column_along(1, point.y());
    const float x = static_cast<float>(point.x()), y = static_cast<float>(point.y()),
                z = static_cast<float>(point.z());
    for (std::uint32_t n = first_[column]; n < first_[column + 1]; ++n) {
        const auto& [low_x, high_x, low_y, high_y, high_z] = entries_[n].bounds;
        if (high_z < z) return true;
        if (x < low_x || x > high_x || y < low_y || y > high_y) continue;
        if (covers(corners_[entries_[n].triangle], point)) return false;
    }
    return true;
}

bool in_line_of_sight(const TracedSurface& surface, const Vec3& point, const Vec3& normal,
                      const Vec3& direction, double spacing) {
    Vec3 position = point + 1e-2 * spacing * (normal + direction), path = direction;
    if (surface.box.boundary[0] != flux::Boundary::open)
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double low = surface.box.min[a], high = surface.box.max[a];
            if (surface.box.boundary[a] == flux::Boundary::periodic)
                position[axis] += position[axis] < low    ? high - low
                                  : position[axis] > high ? low - high
                                                          : 0.0;
            position[axis] = std::clamp(position[axis], low, high);
        }
    // A periodic profile one cell wide does not vary along y, so a path may ignore its y component.
    if (surface.box.boundary[1] == flux::Boundary::periodic &&
        surface.box.max[1] - surface.box.min[1] < 1.5 * spacing)
        path.y() = 0.0;
    if (surface.columns) {
        // Lower the point: where a ceiling meets the surface, the raised one would be inside, not under it.
        position.z() -= 2e-2 * spacing;
        return surface.columns->open_above(position);
    }
    return flux::sees_source(*surface.scene, surface.box, position, path);
}

bool enters_slower_layer(const levelset::MaterialStack& stack, std::span<const double> rates,
                         const Vec3& node, const Vec3& direction) {
    const double dx = stack.domain.spacing;
    // The lowest layer that a point is in, or no more than off cells away from; the number of layers if none.
    const auto layer_at = [&](const Vec3& point, double off) {
        std::size_t k = 0;
        while (k < stack.layers.size() &&
               levelset::distance_at(*stack.layers[k].phi, stack.domain, point) >= off * dx)
            ++k;
        return k;
    };
    // In cells: a line that touches an edge of a layer is shifted into it; interpolation rounds that edge, so
    // that points beside it may seem to lie kRounded inside.
    constexpr double kTouch = 0.02, kRounded = 0.015;
    const std::size_t own = layer_at(node, kTouch);
    const Vec3 start = kTouch * (Vec3(-direction.x(), -direction.y(), 0.0).normalized() + Vec3::UnitZ());
    for (const double along : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        const std::size_t layer = layer_at(node + dx * (start + along * direction), -kRounded);
        if (layer < rates.size() && layer > own && rates[layer] < 0.5 * rates[own]) return true;
    }
    return false;
}

}  // namespace sidewall::app
