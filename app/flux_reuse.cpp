#include "app/flux_reuse.hpp"

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

std::vector<std::vector<double>> carried_values(const SurfaceFlux& surface) {
    std::vector<std::vector<double>> values = surface.wedge_flux;
    values.insert(values.end(), surface.coverage.begin(), surface.coverage.end());
    return values;
}

CoverageField flux_field(const Model& model, const SurfaceFlux& surface) {
    return coverage_field(surface.traced(), surface.wedges, carried_names(model), carried_values(surface));
}

void take_fluxes(const Model& model, const CoverageField& field, SurfaceFlux& surface) {
    std::vector<std::vector<double>> values =
        carry(field, carried_names(model), surface.traced(), surface.wedges);
    const auto first_coverage = values.end() - static_cast<std::ptrdiff_t>(model.coverages.names.size());
    surface.coverage.assign(std::make_move_iterator(first_coverage), std::make_move_iterator(values.end()));
    surface.wedge_flux.assign(std::make_move_iterator(values.begin()),
                              std::make_move_iterator(first_coverage));
}

double flux_change(const Model& model, const CoverageField& field, const SurfaceFlux& surface) {
    // Both looked up alike: the look-up starts a little inside of a wedge.
    const auto look_up = [&](const CoverageField& from) {
        return carry(from, carried_names(model), surface.traced(), surface.wedges);
    };
    const auto before = look_up(field), now = look_up(flux_field(model, surface));
    double most = 0.0;
    for (std::size_t tally = 0; tally < surface.wedge_flux.size(); ++tally) {
        double difference = 0.0, noise = 0.0, sum = 0.0;
        for (std::size_t w = 0; w < surface.wedges.count(); ++w) {
            const double area = surface.wedges.area[w];
            difference += area * std::abs(now[tally][w] - before[tally][w]);
            noise += area * surface.wedge_error[tally][w];
            sum += area * std::abs(now[tally][w]);
        }
        // Of two normal errors of width sigma the mean difference is 2 sigma / sqrt(pi).
        noise *= 2.0 / std::sqrt(std::numbers::pi);
        const double change = std::sqrt(std::max(0.0, difference * difference - noise * noise));
        if (sum > 0.0) most = std::max(most, change / sum);
    }
    return most;
}

std::uint32_t steps_within(double tolerance, double change, std::uint32_t since) {
    constexpr double kMost = 8.0;
    if (since == 0) return 0;
    const double steps = change > 0.0 ? tolerance / change * since : kMost;
    return static_cast<std::uint32_t>(std::min(kMost, steps));
}

}  // namespace sidewall::app
