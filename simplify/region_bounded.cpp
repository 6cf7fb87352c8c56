#include "simplify/region_bounded.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "simplify/collapse.hpp"
#include "surface/infinity.hpp"
#include "surface/topology.hpp"

namespace sidewall::simplify {
namespace {

/// Edges from the nearest feature; the largest number where none can be reached.
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

std::vector<double> graded_lengths(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                   const RegionOptions& options) {
    const std::vector<std::uint32_t> hops = hops_to_features(mesh, features);
    const double most = options.target_vertices ? kInfinity : options.l_max;
    std::vector<double> lengths(hops.size());
    for (std::size_t v = 0; v < hops.size(); ++v)
        lengths[v] = std::min(most, options.l0 + options.step * static_cast<double>(hops[v]));
    return lengths;
}

}  // namespace

Result simplify_regions_bounded(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                const RegionOptions& options) {
    check(options);
    CollapseEngine engine(mesh, options.weights, options.fixed);
    engine.report_to(options.progress);
    const bool has_features = std::any_of(features.begin(), features.end(), [](auto f) { return f != 0; });
    if (!features.empty()) engine.set_features(features);
    engine.set_max_lengths(has_features ? graded_lengths(mesh, features, options) : std::vector<double>{},
                           options.max_length_at);
    Result result;
    const auto run = [&](CollapsePass pass) {
        const std::size_t removed = engine.run(pass);
        result.passes.push_back({pass.max_length, removed});
    };
    if (!options.target_vertices) {
        run({.max_length = options.l_max, .max_error = options.max_error});
    } else {
        // The first bound is what the removal of four fifths takes on a rough surface; for less, it falls
        // with the square of the share.
        constexpr double kFirstError = 0.008, kMuch = 0.8, kMuchLooser = 1.5, kLooser = 1.25,
                         kLittleLooser = 1.08;
        const double share = 1.0 - static_cast<double>(*options.target_vertices) /
                                       static_cast<double>(std::max<std::size_t>(1, mesh.vertices.size()));
        const double usual = kFirstError * (options.l0 + options.step);
        const double first = usual * std::pow(std::clamp(share / kMuch, 0.5, 1.0), 2.0);
        // The first bound is near to none; after the last the target is out of reach.
        constexpr int kMostRounds = 80;
        double error = std::min(options.max_error, first), factor = 1.0;
        for (int round = 0; round < kMostRounds; ++round) {
            const bool last = round + 1 == kMostRounds;
            run({.max_length = kInfinity,
                 .target_vertices = *options.target_vertices,
                 .max_error = last ? options.max_error : error,
                 .stop_when_refused = error < options.max_error,
                 .length_factor = factor});
            if (engine.vertex_count() <= *options.target_vertices) break;
            const bool stuck = result.passes.back().removed == 0 && error >= options.max_error;
            if (stuck && !has_features) break;
            // Grow in large steps while the bound is small by itself.
            if (error < usual) {
                error = std::min({options.max_error, usual, kMuchLooser * error});
                continue;
            }
            // Near the target a large factor would remove more than it takes.
            const bool near = 0.9 * static_cast<double>(engine.vertex_count()) <
                              static_cast<double>(*options.target_vertices);
            const double looser = near ? kLittleLooser : kLooser;
            error = std::min(options.max_error, error * looser);
            factor *= looser;
        }
    }
    result.mesh = engine.take_mesh();
    return result;
}

}  // namespace sidewall::simplify
