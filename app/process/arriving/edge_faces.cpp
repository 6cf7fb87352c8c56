#include "app/process/arriving/edge_faces.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "flux/tracer/flight.hpp"

namespace sidewall::app {
namespace {

// kBeside: distance from the edge, in cells, at which its faces are sampled. kStraight: least cosine for a
// node straight behind a face (6 degrees).
constexpr double kBeside = 0.3, kStraight = 0.9945;
// Number of a beam's directions that are tested from a node; the first ones are spread over the whole beam.
constexpr std::size_t kLooks = 8;
// Shift of a node along the darkest face's normal, in cells, so that one under a cover's very edge is not
// hidden.
constexpr double kUnderEdge = 0.02;
// Cells: a way shorter than kNoWay has no direction; rays from a face start kOffFace above it.
constexpr double kNoWay = 1e-6, kOffFace = 1e-2;

// Calls use(hit, unit normal) for the faces beside a point of an edge.
template <class Use>
void each_face(const TracedSurface& surface, const levelset::Domain& domain, const Vec3& edge, Use&& use) {
    for (int side = 0; side < 6; ++side) {
        const Vec3 beside = (side % 2 == 0 ? kBeside : -kBeside) * domain.spacing * Vec3::Unit(side / 2);
        if (const auto hit =
                surface.scene->closest_point(edge + beside, 2.0 * kBeside * domain.spacing, domain.period()))
            use(hit, area_vector(surface.traced(), hit.triangle).normalized());
    }
}

// The faces beside a point of an edge.
struct Faces {
    surface::SurfaceHit through;  // the face through which the front reaches a node in the shadow
    Vec3 darkest = Vec3::Zero();  // normal of the face with the least flux
    bool covered = false;         // whether there is a face of another material
};

// \param way  from the node to the edge point, in cells.
Faces faces_at(const TracedSurface& surface, const levelset::Domain& domain, const Vec3& edge,
               const Vec3& way, std::int32_t body) {
    const SurfaceFlux& arriving = *surface.arriving;
    Faces faces;
    surface::SurfaceHit own;
    double straightest = kStraight * way.norm(), least = std::numeric_limits<double>::infinity();
    each_face(surface, domain, edge, [&](const surface::SurfaceHit& hit, const Vec3& normal) {
        if (arriving.materials[hit.triangle] != body)
            faces.covered = true;
        else if (normal.dot(way) > straightest)
            own = hit, straightest = normal.dot(way);
        double sum = 0.0;
        for (const std::vector<double>& flux : arriving.flux)
            sum += flux::interpolate(arriving.wedges, flux, hit.triangle, hit.u, hit.v);
        if (sum < least) faces.through = hit, faces.darkest = normal, least = sum;
    });
    if (own) faces.through = own;
    return faces;
}

// Whether a ray from the node hits first a material other than the body's, in all directions of a beam.
bool is_hidden(const TracedSurface& surface, const Vec3& node, std::int32_t body,
               std::span<const flux::DirectFlux::Direction> towards, bool profile) {
    return std::ranges::none_of(towards, [&](const flux::DirectFlux::Direction& d) {
        const Vec3 along(d.towards.x(), profile ? 0.0 : d.towards.y(), d.towards.z());
        const surface::RayHit out = flux::first_hit(*surface.scene, surface.box, node, along);
        return !out || surface.arriving->materials[out.triangle] == body;
    });
}

// A part of a source in a vertical plane: a direction towards it, and what it sends.
struct Sent {
    Vec3 towards;
    double amount;
};

// An untilted source cos^n in the plane of z and \p across.
std::vector<Sent> sent_in_plane(double exponent, const Vec3& across) {
    constexpr int kAngles = 32;
    const double widest = std::min(0.5 * std::numbers::pi, 4.0 / std::sqrt(exponent));
    std::vector<Sent> sent;
    for (int n = 0; n < kAngles; ++n) {
        const double angle = widest * (2.0 * (n + 0.5) / kAngles - 1.0);
        sent.push_back({std::sin(angle) * across + std::cos(angle) * Vec3::UnitZ(),
                        std::pow(std::cos(angle), exponent - 1.0)});
    }
    return sent;
}

// An edge node, the face that stands for the edge, and the horizontal direction from the node to the edge.
struct EdgeNode {
    Vec3 node, on_face, normal, across;
};

// The fluxes of a species at a node over those at its face, of which \p flux is the first.
double shade(const TracedSurface& surface, const EdgeNode& at, std::span<const std::int32_t> inert,
             const flux::Species& species, double flux) {
    if (!flux::is_untilted(species) || !species.bins.empty() || species.source_beta != 0.0) return 1.0;
    double flat = 0.0, seen = 0.0, hidden = 0.0;
    for (const auto& [towards, amount] : sent_in_plane(species.source_exponent, at.across)) {
        flat += amount * towards.z();
        const double arrives = amount * at.normal.dot(towards);
        if (!(arrives > 0.0) || !flux::sees_source(*surface.scene, surface.box, at.on_face, towards))
            continue;
        seen += arrives;
        const surface::RayHit out = flux::first_hit(*surface.scene, surface.box, at.node, towards);
        if (out && std::ranges::count(inert, surface.arriving->materials[out.triangle]) > 0)
            hidden += arrives;
    }
    if (!(flux > 0.0) || !(seen > 0.0)) return 1.0;
    return 1.0 - std::min(1.0, seen / flat / flux) * hidden / seen;
}

}  // namespace

std::vector<std::uint8_t> choose_faces(const TracedSurface& surface, const levelset::MaterialStack& stack,
                                       levelset::Extension& extension) {
    const levelset::Domain& domain = stack.domain;
    const double dx = domain.spacing;
    const bool profile = domain.cells[1] == 1;
    std::vector<std::vector<flux::DirectFlux::Direction>> beams;
    for (const DirectPart& part : surface.arriving->direct)
        for (std::size_t b = 0; b < part.source->beams(); ++b) {
            beams.push_back(part.source->towards(b, 1));
            beams.back().resize(std::min(beams.back().size(), kLooks));
        }
    extension.at_cover.resize(extension.body.size(), 1);
    std::vector<std::uint8_t> hidden(extension.body.size() * beams.size(), 0);
    tbb::parallel_for(std::size_t{0}, extension.body.size(), [&](std::size_t k) {
        levelset::SurfaceSample& sample = extension.samples[extension.plain() + k];
        const std::int32_t body = stack.layers[extension.body[k]].material;
        const Vec3 low(domain.min[0], domain.min[1], 0.0), way = sample.foot.cast<double>(),
                                                           node = low + dx * sample.node.cast<double>();
        const Faces faces = faces_at(surface, domain, node + dx * way, way, body);
        if (!faces.through) return;
        bool lit = true;
        for (std::size_t b = 0; b < beams.size(); ++b) {
            hidden[k * beams.size() + b] =
                is_hidden(surface, node + kUnderEdge * dx * faces.darkest, body, beams[b], profile) ? 1 : 0;
            lit = lit && hidden[k * beams.size() + b] == 0;
        }
        if (lit) {
            extension.body[k] = levelset::Extension::kNoBody;
            return;
        }
        sample.triangle = faces.through.triangle;
        sample.u = static_cast<float>(faces.through.u), sample.v = static_cast<float>(faces.through.v);
        extension.at_cover[k] = faces.covered ? 1 : 0;
    });
    return hidden;
}

std::vector<double> shade_nodes(const TracedSurface& surface, const levelset::MaterialStack& stack,
                                std::span<const flux::Species> species, std::span<const std::int32_t> inert,
                                levelset::Extension& extension) {
    constexpr double kShaded = 0.65;  // least share of the fluxes for which a front from the edge is an arc
    const levelset::Domain& domain = stack.domain;
    const SurfaceFlux& arriving = *surface.arriving;
    std::vector<double> shades(extension.body.size() * species.size(), 1.0);
    extension.shaded.resize(extension.body.size(), 0);
    tbb::parallel_for(std::size_t{0}, extension.body.size(), [&](std::size_t k) {
        levelset::SurfaceSample& sample = extension.samples[extension.plain() + k];
        const Vec3 low(domain.min[0], domain.min[1], 0.0), way = sample.foot.cast<double>(),
                                                           across(way.x(), way.y(), 0.0);
        EdgeNode at{low + domain.spacing * sample.node.cast<double>(), {}, Vec3::Zero(), across.normalized()};
        const std::int32_t body = stack.layers[extension.body[k]].material;
        surface::SurfaceHit own;
        each_face(surface, domain, at.node + domain.spacing * way,
                  [&](const surface::SurfaceHit& hit, const Vec3& normal) {
                      if (arriving.materials[hit.triangle] != body) return;
                      if (!own || normal.dot(way) > at.normal.dot(way)) own = hit, at.normal = normal;
                  });
        if (!own || across.isZero(kNoWay)) return;
        const auto& corners = surface.traced().triangles[own.triangle];
        const auto& x = surface.traced().vertices;
        at.on_face = (1.0 - own.u - own.v) * x[corners[0]] + own.u * x[corners[1]] + own.v * x[corners[2]] +
                     kOffFace * domain.spacing * at.normal;
        double least = 1.0;
        for (std::size_t s = 0, tally = 0; s < species.size(); tally += flux::tally_count(species[s++])) {
            double& here = shades[k * species.size() + s];
            here =
                shade(surface, at, inert, species[s],
                      flux::interpolate(arriving.wedges, arriving.flux[tally], own.triangle, own.u, own.v));
            least = std::min(least, here);
        }
        if (least == 1.0) return;
        sample.triangle = own.triangle;
        sample.u = static_cast<float>(own.u), sample.v = static_cast<float>(own.v);
        extension.shaded[k] = least < kShaded ? 1 : 0;
    });
    return shades;
}

}  // namespace sidewall::app
