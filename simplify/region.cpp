#include "simplify/region.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "simplify/collapse.hpp"
#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

struct Schedule {
    double l0, growth, l_max, max_error;
    std::size_t target;
};

/// Too small a growth of the allowed length would mean a pass for every single vertex.
void check_growth(const TriangleMesh& mesh, double growth) {
    constexpr double kShortest = 1e-3;
    const double mean = base_length(mesh, {}, {});
    if (growth < kShortest * mean)
        throw RecipeError(
            fmt::format("simplify.step = {}: less than {} of the mean edge length {:.4g}, which would take "
                        "thousands of passes; use a tenth of it or more",
                        growth, kShortest, mean));
}

/// The next length of the schedule at which an edge of length \p shortest may collapse: no pass without
/// effect before it.
double length_beyond(double shortest, const Schedule& s) {
    const double length = s.l0 + s.growth * (std::floor((shortest - s.l0) / s.growth) + 1.0);
    return std::max(length, std::nextafter(shortest, std::numeric_limits<double>::infinity()));
}

/// One run of the schedule.
/// \returns how many vertices it removed.
std::size_t run_schedule(CollapseEngine& engine, const Schedule& s, std::vector<PassReport>& passes) {
    std::size_t total = 0;
    const auto run = [&](double length, bool keep_region) {
        const std::size_t removed = engine.run({.max_length = length,
                                                .target_vertices = s.target,
                                                .keep_region = keep_region,
                                                .max_error = s.max_error});
        passes.push_back({length, removed});
        total += removed;
        return removed;
    };
    engine.reset_region();
    if (s.l0 > 0.0) run(std::min(s.l0, s.l_max), false);
    double length = s.l0 + s.growth;
    while (engine.vertex_count() > s.target) {
        const double limit = std::min(length, s.l_max);
        const double shortest = engine.transition_edges().first;
        const bool can_collapse = shortest < limit;
        const std::size_t removed = can_collapse ? run(limit, true) : 0;
        if (limit >= s.l_max || (can_collapse && removed == 0) || std::isinf(shortest)) break;
        const bool stuck = engine.grow_region() == 0 && !can_collapse;
        length = stuck ? length_beyond(shortest, s) : length + s.growth;
    }
    return total;
}

}  // namespace

Result simplify_regions(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                        const RegionOptions& options) {
    check(options);
    CollapseEngine engine(mesh, options.weights, options.fixed);
    engine.report_to(options.progress);
    check_growth(mesh, options.step);
    engine.set_features(features);
    Result result;
    Schedule schedule{options.l0, options.step, options.l_max, options.max_error,
                      options.target_vertices.value_or(0)};
    if (!options.target_vertices) {
        run_schedule(engine, schedule, result.passes);
    } else {
        schedule.l_max = std::numeric_limits<double>::infinity();
        constexpr double kLonger = 1.25;
        for (;;) {
            const std::size_t removed = run_schedule(engine, schedule, result.passes);
            if (engine.vertex_count() <= schedule.target) break;
            engine.reset_region();
            if (removed == 0 && schedule.l0 + schedule.growth > engine.transition_edges().second) break;
            schedule.l0 *= kLonger;
            schedule.growth *= kLonger;
        }
    }
    result.mesh = engine.take_mesh();
    return result;
}

}  // namespace sidewall::simplify
