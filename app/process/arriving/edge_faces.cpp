#include "app/process/arriving/edge_faces.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
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

// The faces beside a point of an edge.
struct Faces {
    surface::SurfaceHit through;  // the face through which the front reaches a node in the shadow
    Vec3 darkest = Vec3::Zero();  // normal of the face with the least flux
    bool covered = false;         // whether there is a face of another material
};

// \param way  from the node to the edge point, in cells.
Faces faces_at(const TracedSurface& surface, const levelset::Domain& domain, const Vec3& edge,
               const Vec3& way, std::int32_t body) {
    const double dx = domain.spacing;
    const SurfaceFlux& arriving = *surface.arriving;
    Faces faces;
    surface::SurfaceHit own;
    double straightest = kStraight * way.norm(), least = std::numeric_limits<double>::infinity();
    for (int side = 0; side < 6; ++side) {
        const Vec3 beside = (side % 2 == 0 ? kBeside : -kBeside) * dx * Vec3::Unit(side / 2);
        const auto hit = surface.scene->closest_point(edge + beside, 2.0 * kBeside * dx, domain.period());
        if (!hit) continue;
        const Vec3 normal = area_vector(surface.traced(), hit.triangle).normalized();
        if (arriving.materials[hit.triangle] != body)
            faces.covered = true;
        else if (normal.dot(way) > straightest)
            own = hit, straightest = normal.dot(way);
        double sum = 0.0;
        for (const std::vector<double>& flux : arriving.flux)
            sum += flux::interpolate(arriving.wedges, flux, hit.triangle, hit.u, hit.v);
        if (sum < least) faces.through = hit, faces.darkest = normal, least = sum;
    }
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

}  // namespace sidewall::app
