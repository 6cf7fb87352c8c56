#include "app/process/arriving/trace.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/line_of_sight.hpp"
#include "app/process/arriving/species_flux.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/meshes/face_points.hpp"

namespace sidewall::app {
namespace {

std::shared_ptr<const surface::RayScene> build_scene(const TriangleMesh& mesh, Timing& timing) {
    const PhaseClock clock(timing.bvh);
    return std::make_shared<const surface::RayScene>(mesh);
}

// Refuses ranks with different surfaces (unequal processors may round differently): their sums mean nothing.
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

// The traced mesh's materials, and its wedges, split at creases and material edges; no flux yet.
SurfaceFlux split_at_creases(const levelset::MaterialStack& stack, TracedSurface& surface) {
    SurfaceFlux parts;
    const TriangleMesh& mesh = surface.traced();
    const levelset::Domain& domain = stack.domain;
    surface.sector.reset();
    if (domain.axial) surface.sector = flux::sector_of(mesh, domain.max[0], domain.max[1] - domain.min[1]);
    parts.materials.resize(mesh.triangles.size());
    const levelset::FacePoints faces(mesh);
    tbb::parallel_for(std::size_t{0}, parts.materials.size(), [&](std::size_t t) {
        // Both triangles of a profile's segment get the same material.
        parts.materials[t] = levelset::exposed_material(stack, faces.of(is_profile(domain) ? t - t % 2 : t));
    });
    parts.wedges = flux::make_wedges(surface.flight_mesh(), parts.materials);
    if (surface.sector) flux::join_rings(*surface.sector, parts.wedges);
    return parts;
}

// The mean change of a coverage over the surface; the largest of all coverages.
double mean_change(const flux::Wedges& wedges, const std::vector<std::vector<double>>& before,
                   const std::vector<std::vector<double>>& after) {
    double most = 0.0;
    for (std::size_t k = 0; k < after.size(); ++k) {
        double change = 0.0, area = 0.0;
        for (std::size_t w = 0; w < wedges.count(); ++w) {
            change += wedges.area[w] * std::abs(after[k][w] - before[k][w]);
            area += wedges.area[w];
        }
        most = std::max(most, area > 0.0 ? change / area : 0.0);
    }
    return most;
}

// The traces of one surface, alternating with reactions of the coverages.
struct Tracing {
    const Recipe& recipe;
    const Model& model;
    const TracedSurface& surface;
    const SurfaceField& carried;
    const TraceRequest& request;
    SurfaceFlux arriving;
    WedgePoints points = wedge_points(model, surface, arriving);
    SharedTraces shared = shared_traces(model, request.methods);
    std::vector<std::vector<double>> balance = {};  // fluxes against which steady coverages desorb; or empty
    std::vector<std::vector<double>> flux_before = {};  // of the pulse's part before; or empty

    std::vector<std::vector<double>> from_before(const std::vector<std::string>& names) const {
        return kept_or_carried(carried, names, surface.traced(), arriving.wedges, surface.box);
    }

    // Traces every species with the sticking of the coverages, then lets these react for \p time.
    void trace_once(int number, double time, bool errors) {
        const auto [sticking, emission] = leaving_of(model, arriving, points, balance);
        if (!are_of(model, shared.methods))
            shared =
                shared_traces(model, choose_methods(recipe, model, surface, arriving, sticking, request));
        TraceRequest own = request;
        own.errors = errors;
        trace_species(recipe, model, surface, sticking, emission, own, shared, arriving);
        arriving.trace->traces = number;
        if (model.coverages.names.empty()) return;
        std::vector<std::vector<double>> next = reacted(model, time, arriving, points, flux_before);
        arriving.trace->coverage_change = mean_change(arriving.wedges, arriving.coverage, next);
        arriving.coverage = std::move(next);
        if (model.desorption && are_steady(model.coverages)) balance = arriving.flux;
    }

    void begin_with_carried_coverages() {
        const Coverages& coverages = model.coverages;
        if (coverages.names.empty()) return;
        arriving.coverage = from_before(coverages.names);
        if (!model.desorption || !are_steady(coverages)) return;
        balance = from_before(carried_names(model));
        balance.resize(balance.size() - coverages.names.size());
    }

    // One trace, then one reaction of the coverages, if any.
    void single() {
        begin_with_carried_coverages();
        trace_once(1, 0.0, request.errors);
    }

    // Traces until the mean change of the coverages is below their tolerance, or two successive traces do not
    // lower it. The rest is noise: traces to a relative error may differ by some rays.
    void steady() {
        begin_with_carried_coverages();
        const int most = model.coverages.most_iterations;
        const auto settle_from = [&](int traces) {
            constexpr int kMostStalled = 2;
            const int last = traces + most;
            double least = kInfinity;
            int stalled = 0;
            do {
                trace_once(++traces, 0.0, request.errors);
                const double change = arriving.trace->coverage_change;
                stalled = change < least ? 0 : stalled + 1;
                least = std::min(least, change);
            } while (traces < last && least > model.coverages.tolerance && stalled < kMostStalled);
            return traces;
        };
        const int traces = settle_from(0);
        if (recipe.flux.method != "auto" || !model.sticking || are_of(model, request.methods)) return;
        // Sites are occupied here and in later time steps: chooses the methods again for this sticking.
        SharedTraces anew =
            shared_traces(model, choose_methods(recipe, model, surface, arriving,
                                                sticking_left(model, surface, arriving), request));
        arriving.trace->methods = anew.methods;
        const bool same = std::ranges::equal(shared.methods, anew.methods, {}, &SpeciesMethod::radiosity,
                                             &SpeciesMethod::radiosity);
        shared = std::move(anew);
        if (same) return;
        arriving.trace.reset();
        settle_from(traces);
    }

    // Traces the equal parts of a pulse on a bare surface. Each is traced with the coverages at its
    // beginning; they react to fluxes extrapolated to its middle from the part before. Errors fall as sites
    // fill: those of the first part decide how many rays to gather, those of the last part are reported.
    void pulsed() {
        const Coverages& coverages = model.coverages;
        arriving.coverage.assign(coverages.names.size(), std::vector<double>(arriving.wedges.count(), 0.0));
        for (int part = 1; part <= coverages.parts; ++part) {
            trace_once(part, coverages.pulse / coverages.parts, part == 1 || part == coverages.parts);
            flux_before = arriving.flux;
        }
    }
};

// Builds what a speed needs if nothing is traced: a scene, or columns for vertical line of sight.
void prepare_sight(const Model& model, double spacing, TracedSurface& surface, Timing& timing) {
    const bool line_of_sight = model.visibility.has_value();
    if (model.depends_on_position || model.speeds ||
        (line_of_sight && !model.visibility->head<2>().isZero(0.0))) {
        surface.scene = build_scene(surface.raw, timing);
    } else if (line_of_sight) {
        const PhaseClock clock(timing.bvh);
        surface.columns = std::make_shared<const ColumnSight>(surface.raw, spacing);
    }
}

}  // namespace

void trace(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
           const SurfaceField& carried, const TraceRequest& request, TracedSurface& surface, Timing& timing) {
    if (model.species.empty()) return prepare_sight(model, stack.domain.spacing, surface, timing);
    for (bool sharp = true;;) {
        require_same(request.shares, surface.traced());
        surface.scene = build_scene(surface.traced(), timing);
        const PhaseClock clock(timing.trace);
        try {
            Tracing tracing{recipe, model, surface, carried, request, split_at_creases(stack, surface)};
            if (model.coverages.pulse > 0.0)
                tracing.pulsed();
            else if (request.settle && !model.coverages.names.empty())
                tracing.steady();
            else
                tracing.single();
            surface.arriving = std::move(tracing.arriving);
            return;
        } catch (const LeakError& leak) {
            // A fold left by simplification or sharp edges in one of many time steps must not end the run.
            if (!surface.simplified && !sharp) throw;
            if (request.warn)
                request.warn(fmt::format("time step {}: {}: tracing the surface {} instead", request.key,
                                         leak.what(),
                                         surface.simplified ? "as extracted" : "without its edges"));
            if (surface.simplified) {
                surface.simplified.reset();
                surface.scene.reset();
            } else {
                sharp = false;
                surface = extract(stack, request.time, timing, surface::SharpEdges::none);
            }
        }
    }
}

TracedSurface trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                            const SurfaceField& carried, const TraceRequest& request, Timing& timing) {
    TracedSurface surface = extract(stack, request.time, timing);
    simplify(recipe, model, stack, carried, request.noise, surface, timing);
    trace(recipe, model, stack, carried, request, surface, timing);
    return surface;
}

void reuse_fluxes(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                  const SurfaceField& carried, TracedSurface& surface, Timing& timing) {
    surface.scene = build_scene(surface.raw, timing);
    const PhaseClock clock(timing.rates);
    surface.arriving =
        carried_fluxes(model, carried, surface.raw, surface.box, split_at_creases(stack, surface));
    add_direct_parts(recipe, model, surface, *surface.arriving);
}

}  // namespace sidewall::app
