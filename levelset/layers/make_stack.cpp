#include "levelset/layers/make_stack.hpp"

#include <algorithm>

#include "levelset/layers/cut_layers.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "levelset/shapes/make_body.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

// How far beyond a body's surface its band may reach, in dx: the band, and as much again, because a bound
// of the distance is smaller than the distance and makes it wider.
constexpr double kMargin = 2.0 * kHalfWidth;

// Bodies are extended by this, in dx, where they are joined to or cut out of others, so that no film without
// thickness is left between them.
constexpr double kTouching = 1e-4;

using Bodies = std::vector<std::pair<int, Shape>>;

// A layer made of a stack's bodies in their order: each is united or, if subtracted, cut out.
struct Union {
    const Bodies& bodies;
    const std::vector<Body>& body;
    double touching;                 // world units
    std::vector<std::size_t> parts;  // indices in body; the first (material or gas) gives the start value

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
    // A union with the same values within \p radius of \p centre, without the bodies that cannot matter
    // there.
    Union near(const Vec3& centre, double radius) const {
        Union result{bodies, body, touching, {}};
        double low = 0.0, high = 0.0;  // of the values so far
        for (const std::size_t k : parts) {
            // On the sides of an open mesh the sign of its distance may change however far the mesh is.
            const double reach = bodies[k].second.kind == ShapeKind::mesh ? kInfinity : radius;
            const double value = part(k, centre), least = value - reach, most = value + reach;
            const bool cuts = bodies[k].second.subtract;
            if (!result.parts.empty() && (cuts ? most < low : least > high)) continue;
            if (result.parts.empty() || (cuts ? least > high : most < low)) {
                result.parts.assign(1, k);
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
    double low = kInfinity, high = -low;
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

}  // namespace sidewall::levelset
