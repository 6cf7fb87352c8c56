#include "app/process/arriving/traced_surface.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <bit>

#include "app/process/arriving/coarsen.hpp"
#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_gradient.hpp"
#include "app/process/arriving/flux_reuse.hpp"
#include "app/process/arriving/species_flux.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

flux::LateralBox lateral_box(const levelset::Domain& domain) {
    flux::LateralBox box{domain.min, domain.max, {}};
    for (std::size_t a = 0; a < 2; ++a)
        box.boundary[a] = domain.side[a] == levelset::Side::periodic ? flux::Boundary::periodic
                                                                     : flux::Boundary::reflective;
    return box;
}

// The stack's surface as it is now.
TracedSurface extracted(const levelset::MaterialStack& stack, Timing& timing) {
    const PhaseClock clock(timing.extract);
    TracedSurface surface;
    surface.box = lateral_box(stack.domain);
    surface.raw = levelset::extract_surface(stack);
    if (surface.raw.triangles.empty())
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    surface.pieces = levelset::surface_pieces(surface.raw, stack.domain);
    return surface;
}

std::shared_ptr<const surface::RayScene> build_scene(const TriangleMesh& mesh, Timing& timing) {
    const PhaseClock clock(timing.bvh);
    return std::make_shared<const surface::RayScene>(mesh);
}

std::vector<std::int32_t> materials_of(const levelset::MaterialStack& stack, const TriangleMesh& mesh) {
    std::vector<std::int32_t> materials(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, materials.size(), [&](std::size_t t) {
        materials[t] = levelset::exposed_material(stack, triangle_centroid(mesh, t));
    });
    return materials;
}

// Ranks on unequal processors may round otherwise, and then their sums mean nothing.
void require_same(const flux::Shares& shares, const TriangleMesh& mesh) {
    if (shares.ranks == 1) return;
    std::uint64_t hash = mesh.triangles.size();
    for (const Vec3& vertex : mesh.vertices)
        for (const double x : vertex)
            hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u + (hash >> 32);
    if (!flux::all_same(shares, hash))
        throw NumericsError(
            "the ranks have come to different surfaces: their processors compute differently; use machines of one kind, and "
            "one installation");
}

// The traced mesh split at creases and material edges, no flux yet.
SurfaceFlux split_at_creases(const levelset::MaterialStack& stack, const TriangleMesh& mesh) {
    SurfaceFlux parts;
    parts.materials = materials_of(stack, mesh);
    parts.wedges = flux::make_wedges(mesh, parts.materials);
    return parts;
}

}  // namespace

TracedSurface trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                            const SurfaceField& carried, const TraceRequest& request, Timing& timing) {
    TracedSurface surface = extracted(stack, timing);
    surface.time = request.time;
    if (model.species.empty()) {
        const bool line_of_sight = model.visibility.has_value();
        if (model.depends_on_position || model.speeds ||
            (line_of_sight && !model.visibility->head<2>().isZero(0.0)))
            surface.scene = build_scene(surface.raw, timing);
        else if (line_of_sight) {
            const PhaseClock clock(timing.bvh);
            surface.columns = std::make_shared<const ColumnSight>(surface.raw, stack.domain.spacing);
        }
        return surface;
    }
    if (recipe.simplify.method != "none")
        surface.simplified = coarsen(recipe, stack, surface.raw, carried, timing);
    for (;;) {
        require_same(request.shares, surface.traced());
        surface.scene = build_scene(surface.traced(), timing);
        const PhaseClock clock(timing.trace);
        try {
            surface.arriving = settled_fluxes(recipe, model, surface,
                                              split_at_creases(stack, surface.traced()), carried, request);
            return surface;
        } catch (const LeakError& leak) {
            // A fold that coarsening left among thousands of time steps must not end the run.
            if (!surface.simplified) throw;
            fmt::print(stderr, "time step {}: {}: tracing the surface as extracted instead\n", request.key,
                       leak.what());
            surface.simplified.reset();
            surface.scene.reset();
        }
    }
}

TracedSurface carried_surface(const Model& model, const levelset::MaterialStack& stack,
                              const SurfaceField& carried, double time, Timing& timing) {
    TracedSurface surface = extracted(stack, timing);
    surface.time = time;
    surface.scene = build_scene(surface.raw, timing);
    const PhaseClock clock(timing.rates);
    surface.arriving = carried_fluxes(model, carried, surface.raw, split_at_creases(stack, surface.raw));
    return surface;
}

SurfaceField field_to_carry(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                            double dt) {
    if (!surface.arriving) return {};
    const SurfaceFlux& arriving = *surface.arriving;
    const bool transient = model.coverages.transient, reuse = recipe.flux.reuse > 0.0 && !transient;
    // What desorbs in steady state goes with the flux that keeps it up, see settled_fluxes.
    const bool fluxes = reuse || (model.desorption && !transient && !model.coverages.names.empty());
    std::vector<std::string> names = fluxes ? carried_names(model) : model.coverages.names;
    std::vector<std::vector<double>> values = fluxes      ? carried_values(arriving)
                                              : transient ? later_coverages(model, surface, dt)
                                                          : arriving.coverage;
    if (surface.simplified && bounds_by_flux(recipe.simplify)) {
        names.emplace_back(kFluxGradient);
        values.push_back(flux_gradient(surface.traced(), arriving));
    }
    return surface_field(surface.traced(), arriving.wedges, names, values, surface.scene);
}

}  // namespace sidewall::app
