#include "app/process/arriving/flux_reuse.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::app {

std::vector<std::string> carried_names(const Model& model) {
    std::vector<std::string> names;
    for (const std::string& name : flux_names(model.species)) names.push_back("flux_" + name);
    names.insert(names.end(), model.coverages.names.begin(), model.coverages.names.end());
    return names;
}

std::vector<std::vector<double>> carried_values(const SurfaceFlux& arriving) {
    std::vector<std::vector<double>> values = arriving.flux;
    values.insert(values.end(), arriving.coverage.begin(), arriving.coverage.end());
    return values;
}

SurfaceField flux_field(const Model& model, const TracedSurface& surface) {
    return surface_field(surface.traced(), surface.arriving->wedges, carried_names(model),
                         carried_values(*surface.arriving), surface.scene);
}

SurfaceFlux carried_fluxes(const Model& model, const SurfaceField& field, const TriangleMesh& mesh,
                           SurfaceFlux parts) {
    std::vector<std::vector<double>> values = carry(field, carried_names(model), mesh, parts.wedges);
    const auto first_coverage = values.end() - static_cast<std::ptrdiff_t>(model.coverages.names.size());
    parts.coverage.assign(std::make_move_iterator(first_coverage), std::make_move_iterator(values.end()));
    parts.flux.assign(std::make_move_iterator(values.begin()), std::make_move_iterator(first_coverage));
    return parts;
}

double flux_change(const Model& model, const SurfaceField& field, const TracedSurface& surface) {
    const SurfaceFlux& arriving = *surface.arriving;
    // Both looked up alike: the look-up starts a little inside of a wedge.
    const auto look_up = [&](const SurfaceField& from) {
        return carry(from, carried_names(model), surface.traced(), arriving.wedges);
    };
    const auto before = look_up(field), now = look_up(flux_field(model, surface));
    double most = 0.0;
    for (std::size_t tally = 0; tally < arriving.flux.size(); ++tally) {
        double difference = 0.0, noise = 0.0, sum = 0.0;
        for (std::size_t w = 0; w < arriving.wedges.count(); ++w) {
            const double area = arriving.wedges.area[w];
            difference += area * std::abs(now[tally][w] - before[tally][w]);
            noise += area * arriving.trace->error[tally][w];
            sum += area * std::abs(now[tally][w]);
        }
        // Of two normal errors of width sigma the mean difference is 2 sigma / sqrt(pi).
        noise *= 2.0 / std::sqrt(std::numbers::pi);
        const double change = std::sqrt(std::max(0.0, difference * difference - noise * noise));
        if (sum > 0.0) most = std::max(most, change / sum);
    }
    return most;
}

std::uint32_t time_steps_within(double tolerance, double change, std::uint32_t since) {
    // The change is extrapolated in a straight line from the few time steps it was measured over. Tracing
    // every eighth time step at least costs an eighth of what there is to save, and bounds what the line may
    // be wrong by.
    constexpr double kMost = 8.0;
    if (since == 0) return 0;
    const double steps = change > 0.0 ? tolerance / change * since : kMost;
    return static_cast<std::uint32_t>(std::min(kMost, steps));
}

FluxReuse next_reuse(double tolerance, const Model& model, const FluxReuse& reuse, const SurfaceField* before,
                     const TracedSurface& surface) {
    if (surface.arriving && !surface.arriving->trace) return {reuse.left - 1, reuse.since + 1};
    if (!surface.arriving || before == nullptr || tolerance == 0.0) return {0, 1};
    const std::uint32_t more =
        time_steps_within(tolerance, flux_change(model, *before, surface), reuse.since);
    return {more > 0 ? more - 1 : 0, 1};
}

}  // namespace sidewall::app
