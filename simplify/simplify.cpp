#include "simplify/simplify.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "simplify/cgal_lindstrom_turk.hpp"
#include "simplify/collapse.hpp"
#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::simplify {
namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Result collapse_by_method(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                          const Options& given) {
    const auto flags = reads_features(given.method) ? features : std::span<const std::uint8_t>{};
    const Options options = resolve(given, base_length(mesh, flags, given.grid_spacing));
    if (options.method == Method::region_bounded) return simplify_regions_bounded(mesh, features, options);
    if (options.method == Method::region) return simplify_regions(mesh, features, options);
    return options.method == Method::cgal_lindstrom_turk ? simplify_cgal_lindstrom_turk(mesh, options)
                                                         : simplify_lindstrom_turk(mesh, options);
}

/// Region schedule: edge lengths, error bound and vertex target, in the mesh's own unit.
struct Schedule {
    double l0, growth, l_max, max_error;
    std::size_t target;
};

/// Refuses a step so small that the schedule would need thousands of passes.
void check_growth(const TriangleMesh& mesh, double growth) {
    constexpr double kShortest = 1e-3;
    const double mean = base_length(mesh, {}, {});
    if (growth < kShortest * mean)
        throw RecipeError(
            "simplify.step = {}: less than {} of the mean edge length {:.4g}, which would take "
            "thousands of passes; use a tenth of it or more",
            growth, kShortest, mean);
}

/// The first length of the schedule at which an edge of length \p shortest may collapse: skips idle passes.
double length_beyond(double shortest, const Schedule& s) {
    const double length = s.l0 + s.growth * (std::floor((shortest - s.l0) / s.growth) + 1.0);
    return std::max(length, std::nextafter(shortest, kInfinity));
}

/// Runs the schedule once: l0 on the whole mesh, then growing lengths in a shrinking transition region.
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

/// Number of edges from each vertex to the nearest feature; the largest uint32 where none can be reached.
std::vector<std::uint32_t> hops_to_features(const TriangleMesh& mesh,
                                            std::span<const std::uint8_t> features) {
    constexpr std::uint32_t kFar = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> hops(mesh.vertices.size(), kFar), front, next;
    for (std::uint32_t v = 0; v < hops.size(); ++v)
        if (features[v]) hops[v] = 0, front.push_back(v);
    const surface::Rows around = surface::vertex_corners(mesh);
    for (std::uint32_t distance = 1; !front.empty(); ++distance, front.swap(next), next.clear())
        for (const std::uint32_t v : front)
            for (const std::uint32_t corner : around[v])
                for (const std::uint32_t w : mesh.triangles[corner / 3])
                    if (hops[w] == kFar) hops[w] = distance, next.push_back(w);
    return hops;
}

/// Allowed edge length per vertex: l0 at features, plus the step per edge, at most l_max if no target.
std::vector<double> graded_lengths(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                   const Options& options) {
    const std::vector<std::uint32_t> hops = hops_to_features(mesh, features);
    const double most = options.target_vertices ? kInfinity : options.l_max.value_or(kInfinity);
    const double l0 = options.l0.value_or(0.0);
    std::vector<double> lengths(hops.size());
    for (std::size_t v = 0; v < hops.size(); ++v)
        lengths[v] = std::min(most, l0 + *options.step * static_cast<double>(hops[v]));
    return lengths;
}

}  // namespace

Result simplify(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options) {
    if (options.method == Method::cgal_lindstrom_turk && options.max_error)
        throw RecipeError(
            "simplify.max_error: method \"cgal-lindstrom-turk\" cannot keep a hard bound; use another "
            "method");
    const double start = now();
    Result result;
    if (options.method == Method::none || mesh.triangles.empty()) {
        result.mesh = mesh;
    } else {
        result = collapse_by_method(mesh, features, options);
        result.seconds.collapse = now() - start;
        for (const auto* attributes : {&mesh.vertex_attributes, &mesh.triangle_attributes})
            for (const Attribute& a : *attributes)
                if (attributes == &mesh.vertex_attributes || a.name != "material")
                    result.dropped_attributes.push_back(a.name);
    }
    result.seconds.total = now() - start;
    return result;
}

Result simplify_lindstrom_turk(const TriangleMesh& mesh, const Options& options) {
    check(options, false);
    CollapseEngine engine(mesh, options);
    const double longest = options.l_max.value_or(kInfinity);
    Result result;
    const std::size_t removed = engine.run({.max_length = longest,
                                            .target_vertices = options.target_vertices.value_or(0),
                                            .max_error = options.max_error.value_or(kInfinity),
                                            .defer_outliers = true});
    result.passes.push_back({longest, removed});
    result.mesh = engine.take_mesh();
    return result;
}

Result simplify_regions(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                        const Options& options) {
    check(options, true);
    CollapseEngine engine(mesh, options);
    check_growth(mesh, *options.step);
    engine.set_features(features);
    Result result;
    Schedule schedule{options.l0.value_or(0.0), *options.step, options.l_max.value_or(kInfinity),
                      options.max_error.value_or(kInfinity), options.target_vertices.value_or(0)};
    if (!options.target_vertices) {
        run_schedule(engine, schedule, result.passes);
    } else {
        schedule.l_max = kInfinity;
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

Result simplify_regions_bounded(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                const Options& options) {
    check(options, true);
    CollapseEngine engine(mesh, options);
    const bool has_features = std::any_of(features.begin(), features.end(), [](auto f) { return f != 0; });
    if (!features.empty()) engine.set_features(features);
    engine.set_max_lengths(has_features ? graded_lengths(mesh, features, options) : std::vector<double>{},
                           options.max_length_at);
    const double max_error = options.max_error.value_or(kInfinity);
    Result result;
    const auto run = [&](CollapsePass pass) {
        const std::size_t removed = engine.run(pass);
        result.passes.push_back({pass.max_length, removed});
    };
    if (!options.target_vertices) {
        run({.max_length = options.l_max.value_or(kInfinity), .max_error = max_error});
    } else {
        const std::size_t target = *options.target_vertices;
        // First error bound: kFirstError (l0 + step) is what removing four fifths (kMuch) takes on a rough
        // surface; it falls with the square of the share to remove.
        constexpr double kFirstError = 0.008, kMuch = 0.8, kMuchLooser = 1.5, kLooser = 1.25,
                         kLittleLooser = 1.08;
        const double share = 1.0 - static_cast<double>(target) /
                                       static_cast<double>(std::max<std::size_t>(1, mesh.vertices.size()));
        const double usual = kFirstError * (options.l0.value_or(0.0) + *options.step);
        const double first = usual * std::pow(std::clamp(share / kMuch, 0.5, 1.0), 2.0);
        // Enough rounds to relax even a first bound near 0. The last one has the full max_error: a target
        // that it misses is out of reach.
        constexpr int kMostRounds = 80;
        double error = std::min(max_error, first), factor = 1.0;
        for (int round = 0; round < kMostRounds; ++round) {
            const bool last = round + 1 == kMostRounds;
            run({.max_length = kInfinity,
                 .target_vertices = target,
                 .max_error = last ? max_error : error,
                 .stop_when_refused = error < max_error,
                 .length_factor = factor});
            if (engine.vertex_count() <= target) break;
            const bool stuck = result.passes.back().removed == 0 && error >= max_error;
            if (stuck && !has_features) break;
            // While the bound is below the usual one, relax it in large steps and leave the lengths alone.
            if (error < usual) {
                error = std::min({max_error, usual, kMuchLooser * error});
                continue;
            }
            // Close to the target relax little, so that the bounds are no looser than the target needs.
            const bool near = 0.9 * static_cast<double>(engine.vertex_count()) < static_cast<double>(target);
            const double looser = near ? kLittleLooser : kLooser;
            error = std::min(max_error, error * looser);
            factor *= looser;
        }
    }
    result.mesh = engine.take_mesh();
    return result;
}

}  // namespace sidewall::simplify
