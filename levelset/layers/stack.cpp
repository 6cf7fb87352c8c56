#include "levelset/layers/stack.hpp"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "levelset/layers/sample.hpp"
#include "levelset/motion/redistance.hpp"
#include "levelset/motion/release.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/shapes/body.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

// How far beyond a body's surface its band is looked for, in dx: the band, and as much again, because a bound
// of the distance is smaller than the distance and makes it wider.
constexpr double kMargin = 2.0 * kHalfWidth;

// Bodies that touch what they are joined to or cut out of reach so much farther, in dx: no film without
// thickness is left between them.
constexpr double kTouching = 1e-3;

// Makes the leaves of the surface's band that lie inside the layer and that it has none for.
// \returns their origins, in ascending order.
std::vector<openvdb::Coord> make_exposed_leaves(Grid& phi, const Grid& surface) {
    std::vector<const Leaf*> above;
    surface.tree().getNodes(above);
    std::vector<std::uint8_t> missing(above.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, above.size(), 8), [&](const auto& range) {
        const auto layer = phi.getConstUnsafeAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const openvdb::Coord& origin = above[n]->origin();
            // A missing leaf lies wholly on one side.
            missing[n] = !layer.probeConstLeaf(origin) && inside(phi, above[n]->cbeginValueOn().getCoord());
        }
    });
    std::vector<openvdb::Coord> made;
    for (std::size_t n = 0; n < above.size(); ++n)
        if (missing[n]) made.push_back(above[n]->origin());
    for (const openvdb::Coord& origin : made) phi.tree().touchLeaf(origin);
    std::sort(made.begin(), made.end());
    return made;
}

// A node of the surface's band that the layer has no voxel for yet: inside, it becomes one; outside, it stays
// out.
void expose(Leaf& leaf, const Leaf& above, bool made) {
    Nodes added = above.getValueMask();
    added -= leaf.getValueMask();
    for (auto it = added.beginOn(); it; ++it)
        if (made || leaf.getValue(it.pos()) < 0.0f) leaf.setValueOn(it.pos(), above.getValue(it.pos()));
}

// phi = max(phi, surface) on the surface's band; elsewhere nothing can have changed, or all of it is gone.
void cut(Grid& phi, const Grid& surface, const Domain& domain, const Grown* grown) {
    const auto snap = static_cast<float>(thinnest_film(domain));
    const float background = phi.background();
    const std::vector<openvdb::Coord> made = make_exposed_leaves(phi, surface);
    std::vector<Leaf*> leaves;
    phi.tree().getNodes(leaves);
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(phi.tree());
    std::atomic<bool> any_empty{false};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 4), [&](const auto& range) {
        const auto top = surface.getConstUnsafeAccessor();
        for (std::size_t k = range.begin(); k != range.end(); ++k) {
            Leaf& leaf = *leaves[k];
            const Leaf* above = top.probeConstLeaf(leaf.origin());
            const bool is_made = std::binary_search(made.begin(), made.end(), leaf.origin());
            if (above) expose(leaf, *above, is_made);
            if (is_made) flood(leaf);  // it has the outside background everywhere else
            const auto first = leaf.cbeginValueOn();
            const float far = !above && first && inside(surface, first.getCoord()) ? -background : background;
            const RowBits* grew = grown ? grown->in(leaf.origin()) : nullptr;
            float* value = leaf.buffer().data();
            for (auto it = leaf.beginValueOn(); it; ++it) {
                const openvdb::Index n = it.pos();
                const float s = above ? above->getValue(n) : far;
                if (value[n] < (grew && has(*grew, n) ? s : s + snap)) value[n] = s;
            }
            if (!trim_leaf(leaf, domain, background)) any_empty = true;
        }
    });
    if (any_empty) openvdb::tools::pruneInactive(phi.tree());
}

using Bodies = std::vector<std::pair<int, Shape>>;

// What of a stack's bodies, in their order, makes a layer: united or, if they are subtracted, cut out.
struct Union {
    const Bodies& bodies;
    const std::vector<Body>& body;
    double touching;                 // world units
    std::vector<std::size_t> parts;  // of body, the first one a piece of material or of gas by itself

    double part(std::size_t k, const Vec3& p) const {
        const double d = body[k].distance(p);
        if (bodies[k].second.subtract) return touching - d;
        return k > 0 && body[k].closed ? d - touching : d;
    }
    double operator()(const Vec3& p) const {
        double d = part(parts.front(), p);
        for (std::size_t i = 1; i < parts.size(); ++i) {
            const std::size_t k = parts[i];
            d = bodies[k].second.subtract ? std::max(d, part(k, p)) : std::min(d, part(k, p));
        }
        return d;
    }
    // The same values within \p radius of \p centre, without the bodies that cannot be told from none there.
    Union near(const Vec3& centre, double radius) const {
        Union result{bodies, body, touching, {}};
        double low = 0.0, high = 0.0;  // of the values so far
        for (const std::size_t k : parts) {
            // On the sides of an open mesh its sign may change at any distance.
            const double reach =
                bodies[k].second.kind == ShapeKind::mesh ? std::numeric_limits<double>::infinity() : radius;
            const double value = part(k, centre), least = value - reach, most = value + reach;
            const bool cuts = bodies[k].second.subtract;
            if (!result.parts.empty() && (cuts ? most < low : least > high)) continue;
            if (result.parts.empty() || (cuts ? least > high : most < low)) {
                result.parts = {k};
                low = least;
                high = most;
                continue;
            }
            result.parts.push_back(k);
            low = cuts ? std::max(low, least) : std::min(low, least);
            high = cuts ? std::max(high, most) : std::min(high, most);
        }
        return result;
    }
};

}  // namespace

MaterialStack sample_stack(const Domain& domain, const Bodies& bodies, const std::function<bool()>& stop,
                           const LeafChoice& where) {
    MaterialStack stack{domain, {}};
    std::vector<Body> body;
    body.reserve(bodies.size());
    for (const auto& [material, shape] : bodies) body.push_back(make_body(shape, domain));
    if (bodies.front().second.subtract)
        throw GeometryError("the first layer cannot be cut out of what lies below: there is nothing");
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto reaches = [&](const Body& other) {
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    };
    std::size_t cuts_end = 0;
    for (std::size_t k = 0; k < body.size(); ++k) {
        if (!bodies[k].second.subtract) continue;
        reaches(body[k]);
        cuts_end = k + 1;
    }
    const double margin = kMargin * domain.spacing;
    for (std::size_t n = 0; n < body.size(); ++n) {
        const auto& [material, shape] = bodies[n];
        if (shape.subtract) continue;
        reaches(body[n]);
        // Layers above are left out, but what is cut out of them is cut out of this one, too.
        Union united{bodies, body, kTouching * domain.spacing, {}};
        for (std::size_t k = 0; k < std::max(n + 1, cuts_end); ++k)
            if (k <= n || bodies[k].second.subtract) united.parts.push_back(k);
        const auto near = [&](const Vec3& centre, double radius) { return united.near(centre, radius); };
        Layer layer{material, sample_grid(domain, united, near, low - margin, high + margin, stop, where)};
        if (!where && layer.phi->activeVoxelCount() == 0)
            throw GeometryError(
                "a layer has no surface inside the domain: check its shape, position and size");
        stack.layers.push_back(layer);
    }
    return stack;
}

void make_distances(MaterialStack& stack) {
    for (const Layer& layer : stack.layers)
        if (layer.phi->activeVoxelCount() > 0) redistance(*layer.phi, stack.domain, kSweepsAnew);
    cut_layers(stack);
}

MaterialStack make_stack(const Domain& domain, const Bodies& bodies, const std::function<bool()>& stop) {
    MaterialStack stack = sample_stack(domain, bodies, stop, {});
    make_distances(stack);
    return stack;
}

MaterialStack make_stack(const Domain& domain, const Bodies& bodies) {
    return make_stack(domain, bodies, {});
}

MaterialStack copy(const MaterialStack& stack) {
    MaterialStack result = stack;
    for (Layer& layer : result.layers) layer.phi = layer.phi->deepCopy();
    if (stack.coarser) result.coarser = std::make_shared<MaterialStack>(copy(*stack.coarser));
    return result;
}

void begin_film(MaterialStack& stack, int material) {
    if (stack.layers.back().material == material) return;
    stack.layers.push_back({material, stack.top().deepCopy()});
    if (stack.coarser) begin_film(*stack.coarser, material);
}

void cut_layers(MaterialStack& stack, const Grown* grown) {
    const Grid& surface = stack.top();
    tbb::parallel_for(std::size_t{0}, stack.layers.size() - 1,
                      [&](std::size_t k) { cut(*stack.layers[k].phi, surface, stack.domain, grown); });
}

}  // namespace sidewall::levelset
