#include "levelset/layers/layer_depths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// Total trilinear weight of a cell's inside corners below which it comes from rounding alone: the point lies
// on a face of the cell, and its material beyond that face.
constexpr float kLeastWeight = 1e-3f;

// A cell whose corners are all bare needs find() only if the weight of inside corners is less than this.
constexpr float kEnough = 0.01f;

// An interface counts as covered by a film if its gradient is within about 25 degrees of the surface's
// (cosine above kParallel); else the surface cuts it. In films thinner than kThinFilm cells slopes are less
// certain, and 60 degrees pass. With a kThinFilm or a kParallel of 0.6 the silicon under an undercut mask
// counts as covered and etches 5 % too little (stack_test.cpp, "a mask undercut by four times its
// thickness").
constexpr float kThinFilm = 0.25f, kParallel = 0.9f, kThinParallel = 0.5f;

// If a layer's depth falls by more than this per length along the surface's inward normal, the normal leads
// out of the layer into the one above: by 1 if straight, by 0 where the layer continues. 0.1 and 0.9 pass
// the tests, too.
constexpr float kStraight = 0.5f;

// A layer as read at one inside node: its depth below the point, and changes of its phi and of the surface's
// over one cell along each axis.
struct Reading {
    float depth = 0.0f;
    Eigen::Vector3f rise = Eigen::Vector3f::Zero(), surface_rise = Eigen::Vector3f::Zero();
};

// The stack's values at a node, ghosts included: whether it lies inside (in the band), and phi of the surface
// and of the layers. A layer without a voxel there lies deeper than the band, as only exposed layers share
// the surface's voxels.
class GridValues {
  public:
    explicit GridValues(const MaterialStack& stack)
        : stack_(stack), top_(stack.top().getConstUnsafeAccessor()) {
        for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k)
            layers_.push_back(stack.layers[k].phi->getConstUnsafeAccessor());
    }
    bool solid(const openvdb::Coord& node) const {
        const openvdb::Coord c = own(node);
        return top_.isValueOn(c) && top_.getValue(c) <= 0.0f;
    }
    float top(const openvdb::Coord& node) const { return top_.getValue(own(node)); }
    float layer(std::size_t k, const openvdb::Coord& node) const {
        const openvdb::Coord c = own(node);
        return layers_[k].isValueOn(c) ? layers_[k].getValue(c) : stack_.top().background();
    }

  private:
    openvdb::Coord own(const openvdb::Coord& node) const {
        return {stack_.domain.source_node(0, node.x()), stack_.domain.source_node(1, node.y()), node.z()};
    }

    const MaterialStack& stack_;
    Grid::ConstUnsafeAccessor top_;
    std::vector<Grid::ConstUnsafeAccessor> layers_;
};

// GridValues of the nodes around one leaf, in flat arrays.
class LeafValues {
  public:
    explicit LeafValues(const MaterialStack& stack) : stack_(stack) {}

    void load(const openvdb::Coord& origin);
    bool is_of(const openvdb::Coord& origin) const { return loaded_ && origin == origin_; }

    // Whether all nodes of the cell at \p low, and those beside them, are held.
    bool holds(const openvdb::Coord& low) const {
        bool in = true;
        for (int a = 0; a < 3; ++a)
            in = in && low[a] > origin_[a] - kBefore && low[a] + 2 < origin_[a] + kSide - kBefore;
        return in;
    }
    bool solid(const openvdb::Coord& node) const { return active(node) && top_[at(node)] <= 0.0f; }
    float top(const openvdb::Coord& node) const { return top_[at(node)]; }
    float layer(std::size_t k, const openvdb::Coord& node) const { return layers_[k][at(node)]; }
    // Whether all lower layers are exposed at a node.
    bool bare(const openvdb::Coord& node) const {
        const std::size_t n = at(node);
        const auto touching = static_cast<float>(thinnest_film(stack_.domain));
        return active(node) && std::all_of(layers_.begin(), layers_.end(), [&](const Values& layer) {
                   return layer[n] - top_[n] <= touching;
               });
    }

  private:
    static constexpr int kBefore = 2, kBehind = 3, kSide = kBefore + 8 + kBehind;
    using Values = std::array<float, kSide * kSide * kSide>;
    std::size_t row(const openvdb::Coord& node) const {
        return static_cast<std::size_t>((node.x() - origin_.x() + kBefore) * kSide + node.y() - origin_.y() +
                                        kBefore);
    }
    int along(const openvdb::Coord& node) const { return node.z() - origin_.z() + kBefore; }
    std::size_t at(const openvdb::Coord& node) const {
        return row(node) * kSide + static_cast<std::size_t>(along(node));
    }
    bool active(const openvdb::Coord& node) const { return (active_[row(node)] >> along(node) & 1) != 0; }
    // Reads a grid's rows of nodes along z, the background where there is no leaf, to \p values.
    // \returns by row, which nodes are active.
    std::array<std::uint16_t, kSide * kSide> read(const Grid& grid, Values& values) const;

    const MaterialStack& stack_;
    bool loaded_ = false;
    openvdb::Coord origin_;
    Values top_;
    std::array<std::uint16_t, kSide * kSide> active_;  // nodes in the surface's band, by row
    std::vector<Values> layers_;
};

// The values and active nodes of a leaf; null for a missing one.
struct LeafRows {
    const float* value = nullptr;
    const Leaf::NodeMaskType* active = nullptr;

    explicit LeafRows(const Leaf* leaf = nullptr)
        : value(leaf ? leaf->buffer().data() : nullptr), active(leaf ? &leaf->getValueMask() : nullptr) {}

    // Nodes first .. first + Count - 1 of the row. \returns which of them are active.
    template <unsigned Count>
    unsigned read(openvdb::Index row, openvdb::Index first, float background, float* to) const {
        if (value == nullptr) {
            std::fill_n(to, Count, background);
            return 0;
        }
        std::memcpy(to, value + 8 * row + first, Count * sizeof(float));
        return static_cast<unsigned>(active->getWord<openvdb::Byte>(row)) >> first & ((1u << Count) - 1);
    }
};

std::array<std::uint16_t, LeafValues::kSide * LeafValues::kSide> LeafValues::read(const Grid& grid,
                                                                                  Values& values) const {
    const auto accessor = grid.getConstUnsafeAccessor();
    const Domain& domain = stack_.domain;
    const float background = grid.background();
    std::array<int, kSide> own_y;
    for (int y = 0; y < kSide; ++y)
        own_y[static_cast<std::size_t>(y)] = domain.source_node(1, origin_.y() + y - kBefore);
    struct Column {
        int x = -1, y = -1;  // leaf coordinates; -1: no leaf of the domain
        LeafRows below, at, above;
    };
    std::array<Column, 3> columns;  // before, at and behind the leaf along y
    std::array<std::uint16_t, kSide * kSide> active;
    std::size_t n = 0;
    for (int x = 0; x < kSide; ++x) {
        const int i = domain.source_node(0, origin_.x() + x - kBefore);
        for (int y = 0; y < kSide; ++y, ++n) {
            const int j = own_y[static_cast<std::size_t>(y)];
            Column& column = columns[static_cast<std::size_t>((y - kBefore + 8) >> 3)];
            if (column.x != i >> 3 || column.y != j >> 3) {
                const auto leaf = [&](int z) {
                    return LeafRows(accessor.probeConstLeaf({i, j, origin_.z() + z}));
                };
                column = {i >> 3, j >> 3, leaf(-8), leaf(0), leaf(8)};
            }
            const auto row = static_cast<openvdb::Index>((i & 7) << 3 | (j & 7));
            float* to = &values[n * kSide];
            active[n] = static_cast<std::uint16_t>(
                column.below.read<kBefore>(row, 8 - kBefore, background, to) |
                column.at.read<8>(row, 0, background, to + kBefore) << kBefore |
                column.above.read<kBehind>(row, 0, background, to + kBefore + 8) << (kBefore + 8));
        }
    }
    return active;
}

void LeafValues::load(const openvdb::Coord& origin) {
    loaded_ = true;
    origin_ = origin;
    active_ = read(stack_.top(), top_);
    layers_.resize(stack_.layers.size() - 1);
    for (std::size_t k = 0; k < layers_.size(); ++k) {
        const auto active = read(*stack_.layers[k].phi, layers_[k]);
        const float background = stack_.top().background();
        for (std::size_t n = 0; n < active.size(); ++n)
            for (std::size_t z = 0; z < kSide; ++z) {
                float& value = layers_[k][n * kSide + z];
                value = (active[n] >> z & 1) != 0 ? value : background;
            }
    }
}

openvdb::Coord low_corner(const Vec3& point) {
    return {static_cast<int>(std::floor(point.x())), static_cast<int>(std::floor(point.y())),
            static_cast<int>(std::floor(point.z()))};
}

}  // namespace

class LayerDepths::Reader {
  public:
    explicit Reader(const MaterialStack& stack) : stack_(stack), grid_(stack), near_(stack) {}

    void at(const Vec3& point, std::span<float> depth) const {
        find(grid_, cell_of(grid_, point), point, depth);
    }
    void at(const Vec3& point, const openvdb::Coord& node, std::span<float> depth);

  private:
    // The corners of a point's cell; trilinear weights of those inside (and their sum), and of the others.
    struct Cell {
        std::array<openvdb::Coord, 8> corners;
        std::array<float, 8> weights{}, outside{};
        float sum = 0.0f;
    };

    template <class Source>
    Cell cell_of(const Source& values, const Vec3& point) const;
    template <class Source>
    float cover_outside(const Source& values, std::size_t layer, const Cell& cell) const;
    template <class Source>
    Reading read(const Source& values, std::size_t layer, const openvdb::Coord& node,
                 const Vec3& point) const;
    template <class Source>
    Reading mean_reading(const Source& values, std::size_t layer, const Cell& cell, const Vec3& point) const;
    template <class Source>
    void find(const Source& values, const Cell& cell, const Vec3& point, std::span<float> depth) const;
    float depth_of(const Reading& reading) const;

    const MaterialStack& stack_;
    const float dx_ = static_cast<float>(stack_.domain.spacing);
    const float touching_ =  // thinnest_film
        static_cast<float>(kExposed) * static_cast<float>(stack_.domain.finest_spacing());
    GridValues grid_;
    LeafValues near_;
};

template <class Source>
LayerDepths::Reader::Cell LayerDepths::Reader::cell_of(const Source& values, const Vec3& point) const {
    const openvdb::Coord low = low_corner(point);
    std::array<std::array<double, 2>, 3> share;  // factors of the weights, by axis and side
    for (int axis = 0; axis < 3; ++axis) {
        const double within = point[axis] - low[axis];
        share[static_cast<std::size_t>(axis)] = {1.0 - std::abs(within), 1.0 - std::abs(within - 1.0)};
    }
    Cell cell;
    for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t x = k & 1, y = k >> 1 & 1, z = k >> 2;
        cell.corners[k] = low.offsetBy(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
        const double weight = share[0][x] * share[1][y] * share[2][z];
        if (values.solid(cell.corners[k]))
            cell.sum += cell.weights[k] = static_cast<float>(weight);
        else
            cell.outside[k] = static_cast<float>(weight);
    }
    return cell;
}

// A film on a body's corner may have no node inside but one on the corner itself, which does not show what
// lies beneath. Nodes outside show it if the film separates the layer from all of them: there it holds its
// own distances. \returns the layer's depth by these, or 0.
template <class Source>
float LayerDepths::Reader::cover_outside(const Source& values, std::size_t layer, const Cell& cell) const {
    float depth = 0.0f;
    for (std::size_t n = 0; n < 8; ++n) {
        const float weight = cell.weights[n] + cell.outside[n];
        if (weight < kLeastWeight) continue;
        const float here = values.layer(layer, cell.corners[n]);
        if (cell.outside[n] > 0.0f && here - values.top(cell.corners[n]) <= touching_) return 0.0f;
        depth += weight * here;
    }
    return depth > kThinFilm * dx_ ? depth : 0.0f;
}

template <class Source>
Reading LayerDepths::Reader::read(const Source& values, std::size_t layer, const openvdb::Coord& node,
                                  const Vec3& point) const {
    const float layer_value = values.layer(layer, node), surface = values.top(node),
                thickness = layer_value - surface;
    Reading reading;
    if (thickness <= touching_) return reading;  // exposed
    reading.depth = layer_value;
    for (int axis = 0; axis < 3; ++axis) {
        // Differences to neighbours inside only, on both sides or on one.
        float run = 0.0f;
        for (const int side : {-1, 1}) {
            openvdb::Coord next = node;
            next[axis] += side;
            if (!values.solid(next)) continue;
            const auto sign = static_cast<float>(side);
            reading.rise[axis] += sign * (values.layer(layer, next) - layer_value);
            reading.surface_rise[axis] += sign * (values.top(next) - surface);
            run += 1.0f;
        }
        if (run == 0.0f) continue;
        reading.rise[axis] /= run;
        reading.surface_rise[axis] /= run;
        reading.depth += reading.rise[axis] * static_cast<float>(point[axis] - node[axis]);
    }
    // Under a film both fronts have equal slopes, and their values differ by its thickness. Extrapolation
    // errs by the film's curvature, which matters most where it is thin.
    const float parallel = thickness < kThinFilm * dx_ ? kThinParallel : kParallel;
    if (reading.rise.dot(reading.surface_rise) > parallel * reading.rise.norm() * reading.surface_rise.norm())
        reading.depth = thickness;
    return reading;
}

template <class Source>
Reading LayerDepths::Reader::mean_reading(const Source& values, std::size_t layer, const Cell& cell,
                                          const Vec3& point) const {
    Reading mean;
    for (std::size_t n = 0; n < 8; ++n) {
        if (cell.weights[n] == 0.0f) continue;
        const Reading reading = read(values, layer, cell.corners[n], point);
        const float weight = cell.weights[n] / cell.sum;
        mean.depth += weight * reading.depth;
        mean.rise += weight * reading.rise;
        mean.surface_rise += weight * reading.surface_rise;
    }
    return mean;
}

float LayerDepths::Reader::depth_of(const Reading& reading) const {
    if (reading.depth > touching_) return reading.depth;
    // The point may be at the layer's end, where the inward normal leads straight into the next one.
    const float length = reading.surface_rise.norm();
    const float along = length > 0.0f ? -reading.rise.dot(reading.surface_rise) / (length * dx_) : 0.0f;
    if (along <= kStraight) return 0.0f;
    return reading.depth < -touching_ ? reading.depth / along : 2.0f * touching_;
}

void LayerDepths::Reader::at(const Vec3& point, const openvdb::Coord& node, std::span<float> depth) {
    const openvdb::Coord leaf = node & ~7, low = low_corner(point);
    if (!near_.is_of(leaf)) near_.load(leaf);
    if (!near_.holds(low)) return at(point, depth);
    // Shortcut for most points of a lowest layer: all corners are bare, and find() would give depth 0.
    const Cell cell = cell_of(near_, point);
    if (cell.sum > kEnough && std::all_of(cell.corners.begin(), cell.corners.end(),
                                          [&](const openvdb::Coord& c) { return near_.bare(c); }))
        std::fill(depth.begin(), depth.end(), 0.0f);
    else
        find(near_, cell, point, depth);
}

template <class Source>
void LayerDepths::Reader::find(const Source& values, const Cell& cell, const Vec3& point,
                               std::span<float> depth) const {
    if (cell.sum < kLeastWeight) {
        // Material thinner than a cell: depths are differences of interpolated values.
        const Domain& domain = stack_.domain;
        const Vec3 world(domain.min[0] + point.x() * domain.spacing,
                         domain.min[1] + point.y() * domain.spacing, point.z() * domain.spacing);
        const double surface = distance_at(stack_.top(), domain, world);
        for (std::size_t k = 0; k < depth.size(); ++k)
            depth[k] = static_cast<float>(distance_at(*stack_.layers[k].phi, domain, world) - surface);
        return;
    }
    for (std::size_t k = 0; k < depth.size(); ++k) {
        depth[k] = depth_of(mean_reading(values, k, cell, point));
        // Only for the layer under the top film: lower ones meet at corners that marching cubes fills.
        if (k + 1 == depth.size() && depth[k] <= touching_)
            depth[k] = std::max(depth[k], cover_outside(values, k, cell));
    }
    // No layer is less deep than the one above it. Where several materials meet under a film, each depth is
    // less certain by itself than all of them together.
    for (std::size_t k = depth.size(); k-- > 1;)
        if (depth[k] > touching_) depth[k - 1] = std::max(depth[k - 1], depth[k]);
}

LayerDepths::LayerDepths(const MaterialStack& stack) : reader_(std::make_shared<Reader>(stack)) {}

void LayerDepths::at(const Vec3& point, std::span<float> depth) const {
    reader_->at(point, depth);
}

void LayerDepths::at(const Vec3& point, const Eigen::Vector3i& node, std::span<float> depth) {
    reader_->at(point, openvdb::Coord(node.x(), node.y(), node.z()), depth);
}

int exposed_material(const MaterialStack& levels, const Vec3& point) {
    const MaterialStack& stack = level_at(levels, point);
    std::vector<float> depth(stack.layers.size() - 1);
    LayerDepths(stack).at(stack.domain.to_index(point), depth);
    std::size_t k = 0;
    while (k < depth.size() && static_cast<double>(depth[k]) > thinnest_film(stack.domain)) ++k;
    return stack.layers[k].material;
}

}  // namespace sidewall::levelset
