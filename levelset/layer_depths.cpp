#include "levelset/layer_depths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// A cell's corners inside that have less trilinear weight than this together are there by rounding alone: the
// point lies on a face of the cell, and its material beyond that face.
constexpr float kLeastWeight = 1e-3f;

// An interface whose rise makes less than about 25 degrees with the surface's (cosine above kParallel) runs
// under a film, else the surface cuts it. In films of less than kThinFilm cells the two fronts' slopes are
// less certain and 60 degrees pass. With a kThinFilm or a kParallel of 0.6 the silicon under an undercut mask
// counts as covered and etches 5 % too little (stack_test.cpp, "a mask undercut by four times its
// thickness").
constexpr float kThinFilm = 0.25f, kParallel = 0.9f, kThinParallel = 0.5f;

// How much of the way along the surface's inward normal a layer's depth falls by: all of it where the surface
// leaves the layer straight into the one above, none where the layer goes on. Halfway between the two; the
// tests pass with 0.1 and 0.9, too.
constexpr float kStraight = 0.5f;

// What one node inside tells of a layer: how deep it lies below the point, and both fronts' rise a cell.
struct Reading {
    float depth = 0.0f;
    Eigen::Vector3f rise = Eigen::Vector3f::Zero(), surface_rise = Eigen::Vector3f::Zero();
};

}  // namespace

class LayerDepths::Reader {
  public:
    explicit Reader(const MaterialStack& stack)
        : stack_(stack),
          dx_(static_cast<float>(stack.domain.spacing)),
          top_(stack.top().getConstUnsafeAccessor()) {
        for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k)
            layers_.push_back(stack.layers[k].phi->getConstUnsafeAccessor());
    }

    void at(const Vec3& point, std::span<float> depth) const;

  private:
    // The corners of a point's cell, with their trilinear weights: of those inside, and of the others.
    struct Cell {
        std::array<openvdb::Coord, 8> corners;
        std::array<float, 8> weights{}, outside{};
        float sum = 0.0f;
    };

    openvdb::Coord own(const openvdb::Coord& node) const {
        return {stack_.domain.source_node(0, node.x()), stack_.domain.source_node(1, node.y()), node.z()};
    }
    bool solid(const openvdb::Coord& own_node) const {
        return top_.isValueOn(own_node) && top_.getValue(own_node) <= 0.0f;
    }
    // A layer that has no voxel here lies deeper than the band: only exposed layers share the surface's
    // voxels.
    float value(std::size_t layer, const openvdb::Coord& own_node) const {
        return layers_[layer].isValueOn(own_node) ? layers_[layer].getValue(own_node)
                                                  : stack_.top().background();
    }

    Cell cell_of(const Vec3& point) const;
    float cover_outside(std::size_t layer, const Cell& cell) const;
    Reading read(std::size_t layer, const openvdb::Coord& node, const Vec3& point) const;
    Reading mean_reading(std::size_t layer, const Cell& cell, const Vec3& point) const;
    float depth_of(const Reading& reading) const;

    const MaterialStack& stack_;
    float dx_;
    Grid::ConstUnsafeAccessor top_;
    std::vector<Grid::ConstUnsafeAccessor> layers_;
};

LayerDepths::Reader::Cell LayerDepths::Reader::cell_of(const Vec3& point) const {
    const Vec3 floor(std::floor(point.x()), std::floor(point.y()), std::floor(point.z()));
    const openvdb::Coord low(static_cast<int>(floor.x()), static_cast<int>(floor.y()),
                             static_cast<int>(floor.z()));
    Cell cell;
    for (int n = 0; n < 8; ++n) {
        const openvdb::Coord corner(n & 1, n >> 1 & 1, n >> 2);
        const auto k = static_cast<std::size_t>(n);
        cell.corners[k] = low + corner;
        double weight = 1.0;
        for (int axis = 0; axis < 3; ++axis)
            weight *= 1.0 - std::abs(point[axis] - floor[axis] - corner[axis]);
        if (solid(own(cell.corners[k])))
            cell.sum += cell.weights[k] = static_cast<float>(weight);
        else
            cell.outside[k] = static_cast<float>(weight);
    }
    return cell;
}

// A film on a body's corner may have no node inside but one on the corner itself, which tells nothing of what
// lies beyond. The nodes outside do where the film keeps the layer away from all of them: there it holds its
// own distances. \returns the layer's depth by these, or 0.
float LayerDepths::Reader::cover_outside(std::size_t layer, const Cell& cell) const {
    float depth = 0.0f;
    for (std::size_t n = 0; n < 8; ++n) {
        const float weight = cell.weights[n] + cell.outside[n];
        if (weight < kLeastWeight) continue;
        const openvdb::Coord node = own(cell.corners[n]);
        const float here = value(layer, node);
        if (cell.outside[n] > 0.0f && here - top_.getValue(node) <= static_cast<float>(kExposed) * dx_)
            return 0.0f;
        depth += weight * here;
    }
    return depth > kThinFilm * dx_ ? depth : 0.0f;
}

Reading LayerDepths::Reader::read(std::size_t layer, const openvdb::Coord& node, const Vec3& point) const {
    const openvdb::Coord here = own(node);
    const float layer_value = value(layer, here), surface = top_.getValue(here),
                thickness = layer_value - surface;
    Reading reading;
    if (thickness <= static_cast<float>(kExposed) * dx_) return reading;  // exposed
    reading.depth = layer_value;
    for (int axis = 0; axis < 3; ++axis) {
        // From neighbours inside alone, on both sides or on one.
        float run = 0.0f;
        for (const int side : {-1, 1}) {
            openvdb::Coord next = node;
            next[axis] += side;
            next = own(next);
            if (!solid(next)) continue;
            const auto sign = static_cast<float>(side);
            reading.rise[axis] += sign * (value(layer, next) - layer_value);
            reading.surface_rise[axis] += sign * (top_.getValue(next) - surface);
            run += 1.0f;
        }
        if (run == 0.0f) continue;
        reading.rise[axis] /= run;
        reading.surface_rise[axis] /= run;
        reading.depth += reading.rise[axis] * static_cast<float>(point[axis] - node[axis]);
    }
    // Under a film the two rise alike, and their difference is its thickness; extrapolating errs by the
    // film's curvature, which matters most where it is thin.
    const float parallel = thickness < kThinFilm * dx_ ? kThinParallel : kParallel;
    if (reading.rise.dot(reading.surface_rise) > parallel * reading.rise.norm() * reading.surface_rise.norm())
        reading.depth = thickness;
    return reading;
}

Reading LayerDepths::Reader::mean_reading(std::size_t layer, const Cell& cell, const Vec3& point) const {
    Reading mean;
    for (std::size_t n = 0; n < 8; ++n) {
        if (cell.weights[n] == 0.0f) continue;
        const Reading reading = read(layer, cell.corners[n], point);
        const float weight = cell.weights[n] / cell.sum;
        mean.depth += weight * reading.depth;
        mean.rise += weight * reading.rise;
        mean.surface_rise += weight * reading.surface_rise;
    }
    return mean;
}

float LayerDepths::Reader::depth_of(const Reading& reading) const {
    const float touching = static_cast<float>(kExposed) * dx_;
    if (reading.depth > touching) return reading.depth;
    // In a layer, or at its end where the surface leaves it straight into the next one?
    const float length = reading.surface_rise.norm();
    const float along = length > 0.0f ? -reading.rise.dot(reading.surface_rise) / (length * dx_) : 0.0f;
    if (along <= kStraight) return 0.0f;
    return reading.depth < -touching ? reading.depth / along : 2.0f * touching;
}

void LayerDepths::Reader::at(const Vec3& point, std::span<float> depth) const {
    const Cell cell = cell_of(point);
    if (cell.sum < kLeastWeight) {
        // Material thinner than a cell: the values as they are.
        const Domain& domain = stack_.domain;
        const Vec3 world(domain.min[0] + point.x() * domain.spacing,
                         domain.min[1] + point.y() * domain.spacing, point.z() * domain.spacing);
        const double surface = distance_at(stack_.top(), domain, world);
        for (std::size_t k = 0; k < layers_.size(); ++k)
            depth[k] = static_cast<float>(distance_at(*stack_.layers[k].phi, domain, world) - surface);
        return;
    }
    const float touching = static_cast<float>(kExposed) * dx_;
    for (std::size_t k = 0; k < layers_.size(); ++k) {
        depth[k] = depth_of(mean_reading(k, cell, point));
        // What covers it there is the film on all; lower layers meet at corners that marching cubes fills.
        if (k + 1 == layers_.size() && depth[k] <= touching)
            depth[k] = std::max(depth[k], cover_outside(k, cell));
    }
    // No layer lies above the one over it. Where several materials meet under a film, each by itself is
    // harder to tell than all of them together.
    for (std::size_t k = layers_.size(); k-- > 1;)
        if (depth[k] > touching) depth[k - 1] = std::max(depth[k - 1], depth[k]);
}

LayerDepths::LayerDepths(const MaterialStack& stack) : reader_(std::make_unique<Reader>(stack)) {}
LayerDepths::~LayerDepths() = default;
LayerDepths::LayerDepths(LayerDepths&&) noexcept = default;
LayerDepths& LayerDepths::operator=(LayerDepths&&) noexcept = default;

void LayerDepths::at(const Vec3& point, std::span<float> depth) const {
    reader_->at(point, depth);
}

std::size_t exposed_layer(const MaterialStack& stack, const Vec3& point) {
    std::vector<float> depth(stack.layers.size() - 1);
    LayerDepths(stack).at(stack.domain.to_index(point), depth);
    for (std::size_t k = 0; k < depth.size(); ++k)
        if (static_cast<double>(depth[k]) <= kExposed * stack.domain.spacing) return k;
    return stack.layers.size() - 1;
}

int exposed_material(const MaterialStack& stack, const Vec3& point) {
    return stack.layers[exposed_layer(stack, point)].material;
}

}  // namespace sidewall::levelset
