#include "levelset/meshes/fronts.hpp"

#include <openvdb/tree/LeafManager.h>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/layers/levels.hpp"

namespace sidewall::levelset {
namespace {

// Reach of the plane fits, in nodes along each axis: for the layer's own distances, for those of buried
// nodes, and for the next front. Any cell that the next front passes has two columns of buried nodes within
// reach; a front that ends two cells farther on, as at a trench's floor, is still a plane within its reach.
constexpr int kNodesAround = 2, kBuriedAround = 3, kNextAround = 1;

// The least slope of a plane that is fitted to distances: an exact distance has 1.
constexpr double kLeastSlope = 0.7;

// Cells: the corners of a cell that both fronts pass through lie within two cells of either.
constexpr float kNearFront = 2.5f;

// Cells: a buried node is farther from the next front than from its layer's own by kBuried, and kLeastBuried
// below the next front. At other nodes the layer's distance may be that to the edge where the next front cuts
// it off, or be computed from there.
constexpr float kBuried = 0.5f, kLeastBuried = 0.75f;

// The next front crosses a layer's where their normals make more than 60 degrees.
constexpr double kCrossing = 0.5;

// Cells: if the closest point of a layer lies deeper than this below the next front, it is on the layer's own
// front, not on the edge where the next front cuts it off.
constexpr double kCovered = 0.1;

// Cells: largest root-mean-square misfit of a plane; more is an edge or a corner.
constexpr double kFlat = 0.1;

// A plane fitted to a layer's distances around a node.
struct Plane {
    int count = 0;  // number of distances
    double value = 0.0, misfit = 0.0;
    Vec3 rise = Vec3::Zero();  // gradient, per cell
    bool two_sided = false;    // some nodes lie inside the layer and some outside
};

// Distances of a layer and of the next one above at a leaf's nodes and around them; NaN where the layer does
// not hold the distance to its own front.
class KnownValues {
  public:
    // \param next  the layer above.
    // \returns whether the layer's own distance is known at any node.
    bool load(const Grid& layer, const Grid& next, const Domain& domain, const openvdb::Coord& origin) {
        const auto own = layer.getConstUnsafeAccessor(), above = next.getConstUnsafeAccessor();
        dx_ = static_cast<float>(domain.spacing);
        const auto touching = static_cast<float>(thinnest_film(domain));
        bool any = false;
        std::size_t n = 0;
        for (int x = -kBuriedAround; x < 8 + kBuriedAround; ++x)
            for (int y = -kBuriedAround; y < 8 + kBuriedAround; ++y)
                for (int z = -kBuriedAround; z < 8 + kBuriedAround;) {  // by leaves
                    openvdb::Coord node(domain.source_node(0, origin.x() + x),
                                        domain.source_node(1, origin.y() + y), origin.z() + z);
                    const Leaf *mine = own.probeConstLeaf(node), *other = above.probeConstLeaf(node);
                    const float tile = other == nullptr ? above.getValue(node) : 0.0f;
                    for (const int end = z < 0 ? 0 : z < 8 ? 8 : 8 + kBuriedAround; z < end; ++z, ++n) {
                        node.z() = origin.z() + z;
                        const openvdb::Index offset = Leaf::coordToOffset(node);
                        value_[n] = std::numeric_limits<float>::quiet_NaN();
                        next_[n] = other == nullptr ? tile : other->getValue(offset);
                        if (mine == nullptr || !mine->isValueOn(offset)) continue;
                        const float here = mine->getValue(offset);
                        // A node of the layer's band outside the next one's band lies inside the next layer.
                        if (other == nullptr || !other->isValueOn(offset))
                            next_[n] = -next.background();
                        else if (here - next_[n] <= touching)
                            continue;
                        value_[n] = here;
                        any = true;
                    }
                }
        return any;
    }

    bool known(const openvdb::Coord& local) const {
        return !std::isnan(value_[at(local.x(), local.y(), local.z())]);
    }
    bool buried(const openvdb::Coord& local) const { return buried(at(local.x(), local.y(), local.z())); }

    // The value at a node of the plane through the known distances around it; \p otherwise if there is none.
    float fitted(const openvdb::Coord& local, float otherwise) const {
        const Plane plane =
            fit(local, kNodesAround, value_, [&](std::size_t n) { return !std::isnan(value_[n]); });
        return tells(plane) ? static_cast<float>(plane.value) : otherwise;
    }

    // The value at a node of the plane fitted to buried nodes alone, if they lie in one plane and the next
    // front crosses it as another plane that continues beyond; else none.
    std::optional<float> crossed(const openvdb::Coord& local) const {
        const Plane buried_front =
            fit(local, kBuriedAround, value_, [&](std::size_t n) { return buried(n); });
        if (!tells(buried_front) || !buried_front.two_sided || !flat(buried_front)) return std::nullopt;
        const Plane next = fit(local, kNextAround, next_,
                               [&](std::size_t n) { return std::abs(next_[n]) < kNearFront * dx_; });
        const double cosine =
            next.rise.dot(buried_front.rise) / (next.rise.norm() * buried_front.rise.norm());
        if (!tells(next) || !flat(next) || std::abs(cosine) > kCrossing) return std::nullopt;
        if (known(local) && nearest_is_covered(local)) return std::nullopt;
        return static_cast<float>(buried_front.value);
    }

  private:
    static constexpr int kSide = 8 + 2 * kBuriedAround;
    using Values = std::array<float, kSide * kSide * kSide>;
    static std::size_t at(int x, int y, int z) {
        return static_cast<std::size_t>(((x + kBuriedAround) * kSide + y + kBuriedAround) * kSide + z +
                                        kBuriedAround);
    }
    bool buried(std::size_t n) const {
        return !std::isnan(value_[n]) && next_[n] <= -kLeastBuried * dx_ &&
               std::abs(value_[n]) <= -next_[n] - kBuried * dx_;
    }
    bool tells(const Plane& plane) const {
        return plane.count >= 4 && plane.rise.norm() > kLeastSlope * static_cast<double>(dx_);
    }

    bool flat(const Plane& plane) const { return plane.misfit <= kFlat * static_cast<double>(dx_); }

    // Whether the closest point of the layer's front to a node lies below the next front.
    bool nearest_is_covered(const openvdb::Coord& local) const {
        const Plane mine = fit(local, 1, value_, [&](std::size_t n) { return !std::isnan(value_[n]); });
        if (!tells(mine)) return false;
        const double way = static_cast<double>(value_[at(local.x(), local.y(), local.z())]) / dx_;
        const Vec3 foot = Vec3(local.x(), local.y(), local.z()) - way * mine.rise.normalized();
        const Eigen::Vector3i low = foot.array().floor().cast<int>();
        double next = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            const Eigen::Vector3i node = low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
            const Vec3 share = 1.0 - (foot - node.cast<double>()).array().abs();
            next += share.prod() * next_[at(node.x(), node.y(), node.z())];
        }
        return next < -kCovered * dx_;
    }

    template <class Takes>
    Plane fit(const openvdb::Coord& local, int reach, const Values& values, Takes&& takes) const {
        Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
        Eigen::Vector4d right = Eigen::Vector4d::Zero();
        double squares = 0.0;
        Plane plane;
        bool inside = false, outside = false;
        for (int x = -reach; x <= reach; ++x)
            for (int y = -reach; y <= reach; ++y)
                for (int z = -reach; z <= reach; ++z) {
                    const std::size_t n = at(local.x() + x, local.y() + y, local.z() + z);
                    if (!takes(n)) continue;
                    const auto value = static_cast<double>(values[n]);
                    const double squared = std::max(1, x * x + y * y + z * z);
                    const double weight = 1.0 / (squared * squared);  // the nearest nodes count most
                    const Eigen::Vector4d row(1.0, x, y, z);
                    normal += weight * row * row.transpose();
                    right += weight * value * row;
                    squares += weight * value * value;
                    (value < 0.0 ? inside : outside) = true;
                    ++plane.count;
                }
        if (plane.count < 4) return plane;
        const double weights = normal(0, 0);
        // The ridge makes undetermined slopes 0, which tells() detects: a distance rises by 1 per cell.
        const double ridge = 1e-6 * normal.trace();
        for (int k = 1; k < 4; ++k) normal(k, k) += ridge;
        const Eigen::Vector4d solution = normal.ldlt().solve(right);
        plane.value = solution[0];
        plane.rise = solution.tail<3>();
        plane.misfit = std::sqrt(std::max(0.0, squares - solution.dot(right)) / weights);
        plane.two_sided = inside && outside;
        return plane;
    }

    float dx_ = 1.0f;
    Values value_, next_;
};

// Continues the fronts of the lower layers beyond the lines where the layers above cut them off. A layer's
// grid holds the greater of its own distance and the next layer's, so that its own is known only where it is
// greater. Nodes within two cells of such nodes get the value of a plane fitted to these, no higher than the
// next layer's value; all other nodes count as deep inside. Beside an edge where the next front cuts the
// layer off, as at the flush wall of a trench, re-distancing has replaced the layer's distances by those to
// the edge. There the plane of the buried nodes counts if the next front crosses it as another plane that
// continues beyond, no higher than the values that are there. The greatest of the continued fronts of a layer
// and of all above it is that layer's level set.
//
// \param finer  the next finer level, or null: fronts are continued where the stack's own level counts.
// \returns a grid for every layer but the last, with the voxels of the layer's own grid.
std::vector<GridPtr> continued_fronts(const MaterialStack& stack, const MaterialStack* finer) {
    std::vector<GridPtr> fronts;
    const float near = kNearFront * static_cast<float>(stack.domain.spacing),
                deep = -stack.top().background();
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        fronts.push_back(stack.layers[k].phi->deepCopy());
        openvdb::tree::LeafManager<Grid::TreeType> leaves(fronts.back()->tree());
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            if (!counts_in(stack, finer, leaf.origin().x(), leaf.origin().y())) return;
            KnownValues values;
            const bool any =
                values.load(*stack.layers[k].phi, *stack.layers[k + 1].phi, stack.domain, leaf.origin());
            for (auto it = leaf.beginValueOn(); it; ++it) {
                const openvdb::Coord local = it.getCoord() - leaf.origin();
                if (any && values.buried(local)) continue;
                const bool known = any && values.known(local), is_near = any && std::abs(*it) < near;
                if (const auto plane = is_near ? values.crossed(local) : std::nullopt)
                    it.setValue(std::min(*it, *plane));
                else if (!known)
                    it.setValue(is_near ? std::min(*it, values.fitted(local, deep)) : deep);
            }
        });
    }
    return fronts;
}

// Cells: the film that covers a layer at convex edges and at hollow ones, and how far from the layer's front
// it is required: at the ends of grid edges that the front crosses. Marching cubes cuts off less than
// kCovering of a convex corner, through which a thinner film's surface would pass; a hollow corner it fills.
constexpr double kCovering = 0.5, kCoveringHollow = 0.15, kBesideFront = 1.0;

}  // namespace

Fronts::Fronts(const MaterialStack& stack) {
    const MaterialStack* finer = nullptr;
    for (const MaterialStack* at = &stack; at != nullptr; finer = at, at = at->coarser.get()) {
        Level level{at, continued_fronts(*at, finer), {}, {}};
        for (const Layer& layer : at->layers) level.own.push_back(layer.phi->getConstUnsafeAccessor());
        for (const GridPtr& front : level.grids) level.continued.push_back(front->getConstUnsafeAccessor());
        level.continued.push_back(at->top().getConstUnsafeAccessor());
        levels_.push_back(std::move(level));
    }
}

std::size_t Fronts::level_of(const Vec3& point) const {
    for (std::size_t n = 0; n + 1 < levels_.size(); ++n) {
        const Domain& domain = levels_[n].stack->domain;
        const Vec3 index = domain.to_index(point);
        constexpr double kBeside = 0.25;  // cells: finds both columns beside a node between two
        for (const double x : {-kBeside, kBeside})
            for (const double y : {-kBeside, kBeside}) {
                const auto node = [&](int axis, double beside) {
                    const double i = std::floor(index[axis] + beside);
                    return std::clamp(static_cast<int>(i), 0, domain.last_node(axis));
                };
                if (levels_[n].stack->columns.of_node(node(0, x), node(1, y))) return n;
            }
    }
    return levels_.size() - 1;
}

GridEdge Fronts::edge_of(const Vec3& point) const {
    GridEdge edge;
    edge.level = level_of(point);
    const Domain& domain = levels_[edge.level].stack->domain;
    const Vec3 index = domain.to_index(point);
    std::array<int, 3> low{};
    std::array<double, 3> off{};
    for (int a = 0; a < 3; ++a) {
        const auto k = static_cast<std::size_t>(a);
        off[k] = std::abs(index[a] - std::round(index[a]));
        if (off[k] > off[static_cast<std::size_t>(edge.axis)]) edge.axis = a;
        low[k] = static_cast<int>(std::round(index[a]));
    }
    const auto a = static_cast<std::size_t>(edge.axis);
    constexpr double kRounding = 1e-6;
    edge.on_grid_edge = levels_.size() == 1 || (off[(a + 1) % 3] < kRounding && off[(a + 2) % 3] < kRounding);
    low[a] = static_cast<int>(std::floor(index[edge.axis]));
    edge.t = index[edge.axis] - low[a];
    for (int end = 0; end < 2; ++end) {
        std::array<int, 3> node = low;
        node[a] += end;
        edge.node[static_cast<std::size_t>(end)] = {domain.source_node(0, node[0]),
                                                    domain.source_node(1, node[1]), node[2]};
    }
    return edge;
}

double Fronts::height(std::size_t layer, const Vec3& point) const {
    const Level& level = levels_[level_of(point)];
    const Domain& domain = level.stack->domain;
    const Vec3 index = domain.to_index(point);
    const Eigen::Vector3i low = index.array().floor().cast<int>();
    double value = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i node = low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
        const Vec3 share = 1.0 - (index - node.cast<double>()).array().abs();
        const openvdb::Coord own(domain.source_node(0, node.x()), domain.source_node(1, node.y()), node.z());
        value += share.prod() * static_cast<double>(level.continued[layer].getValue(own));
    }
    return value / domain.spacing;
}

surface::SharpEdges edges_at(const MaterialStack& level, std::size_t layer, const std::array<int, 3>& cell) {
    const double dx = level.domain.spacing, touching = thinnest_film(level.domain) / dx;
    const auto own = level.layers[layer].phi->getConstUnsafeAccessor();
    std::vector<decltype(level.layers[layer].phi->getConstUnsafeAccessor())> upper;
    for (std::size_t k = layer + 1; k < level.layers.size(); ++k)
        upper.push_back(level.layers[k].phi->getConstUnsafeAccessor());
    surface::SharpEdges edges = surface::SharpEdges::all;
    bool bare = false, covered = false;
    for (int n = 0; n < 64; ++n) {
        const openvdb::Coord node(level.domain.source_node(0, cell[0] + n % 4 - 1),
                                  level.domain.source_node(1, cell[1] + n / 4 % 4 - 1), cell[2] + n / 16 - 1);
        float here = 0.0f;
        if (!own.probeValue(node, here) || std::abs(here) > static_cast<float>(kBesideFront * dx)) continue;
        double film = 0.0;  // in cells, of the lowest layer that is there
        for (std::size_t k = 0; k < upper.size() && film <= touching; ++k) {
            float other = 0.0f;
            // A node that is not in an upper layer's band lies inside it.
            film = upper[k].probeValue(node, other) ? (static_cast<double>(here) - other) / dx : 1.0;
        }
        (film > kCoveringHollow ? covered : bare) = true;
        if (film > kCoveringHollow && film < kCovering) edges = surface::SharpEdges::hollow;
    }
    return bare && covered ? surface::SharpEdges::none : edges;
}

surface::SharpEdges edges_below(const MaterialStack& stack, std::size_t layer) {
    const MaterialStack* finer = nullptr;
    double least = kCovering;
    for (const MaterialStack* level = &stack; level != nullptr; finer = level, level = level->coarser.get()) {
        const double dx = level->domain.spacing;
        const auto near = static_cast<float>(kBesideFront * dx);
        const auto next = level->layers[layer + 1].phi->getConstUnsafeAccessor();
        for (auto it = level->layers[layer].phi->cbeginValueOn(); it; ++it) {
            if (std::abs(*it) > near) continue;
            float above = 0.0f;  // a node that is not in the next layer's band lies inside it
            if (!next.probeValue(it.getCoord(), above)) continue;
            const double film = static_cast<double>(*it - above) / dx;
            if (film >= least || !counts_at(*level, finer, it.getCoord().x(), it.getCoord().y())) continue;
            least = film;
            if (least < kCoveringHollow) return surface::SharpEdges::none;
        }
    }
    return least < kCovering ? surface::SharpEdges::hollow : surface::SharpEdges::all;
}

}  // namespace sidewall::levelset
