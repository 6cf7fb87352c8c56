#include "app/results/scallops.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace sidewall::app {
namespace {

// A place of the wall that stands out into the opening, by how much on the side where it does less.
struct Edge {
    std::size_t at;
    double height;
};

// The half openings from the mouth down to where the floor begins: there the wall is less than 80 degrees
// steep.
std::vector<double> half_wall(std::span<const double> openings, double step) {
    constexpr double kSteep = 5.67;  // tan(80 degrees)
    std::vector<double> half;
    half.reserve(openings.size());
    for (const double w : openings)
        if (std::isfinite(w)) half.push_back(0.5 * w);
    while (half.size() > 1 && half[half.size() - 2] - half.back() > step / kSteep) half.pop_back();
    return half;
}

// Slope of the wall's middle half by least squares.
double mean_slope(const std::vector<double>& half) {
    double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
    for (std::size_t k = half.size() / 4; k < 3 * half.size() / 4; ++k) {
        const auto x = static_cast<double>(k);
        n += 1.0, sx += x, sy += half[k], sxx += x * x, sxy += x * half[k];
    }
    const double spread = n * sxx - sx * sx;
    return spread > 0.0 ? (n * sxy - sx * sy) / spread : 0.0;
}

// How far the wall goes back from a place, in steps of \p by, until it stands out farther than there.
double rise(const std::vector<double>& half, std::size_t from, std::ptrdiff_t by) {
    double most = half[from];
    const auto n = static_cast<std::ptrdiff_t>(half.size());
    for (auto k = static_cast<std::ptrdiff_t>(from) + by; k >= 0 && k < n; k += by) {
        const double here = half[static_cast<std::size_t>(k)];
        if (here < half[from]) break;
        most = std::max(most, here);
    }
    return most - half[from];
}

std::vector<Edge> edges_of(const std::vector<double>& half, double least) {
    std::vector<Edge> edges;
    for (std::size_t k = 1; k + 1 < half.size(); ++k) {
        if (!(half[k] < half[k - 1] && half[k] <= half[k + 1])) continue;
        const double height = std::min(rise(half, k, -1), rise(half, k, 1));
        if (height > least) edges.push_back({k, height});
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.height > b.height; });
    // Of two or more edges the last one before the largest ratio to the next, which for the last of all is
    // the least.
    std::size_t count = edges.size();
    double widest = 0.0;
    for (std::size_t k = 2; k <= edges.size(); ++k) {
        const double next = k < edges.size() ? edges[k].height : least, ratio = edges[k - 1].height / next;
        if (ratio > widest) widest = ratio, count = k;
    }
    edges.resize(count);
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.at < b.at; });
    return edges;
}

// The deepest place between two edges, behind the line through them.
double depth_between(const std::vector<double>& half, std::size_t from, std::size_t to) {
    double most = 0.0;
    for (std::size_t k = from; k <= to; ++k) {
        const double share = static_cast<double>(k - from) / static_cast<double>(to - from);
        most = std::max(most, half[k] - (1.0 - share) * half[from] - share * half[to]);
    }
    return most;
}

double number_of(const Json& metrology, const char* name) {
    return metrology.contains(name) && metrology[name].is_number() ? metrology[name].get<double>() : kNone;
}

// Cycles of all loops: of those within loops, too.
double cycles_of(const std::vector<Step>& steps) {
    double cycles = 0.0;
    for (const Step& step : steps)
        if (!step.steps.empty())
            cycles += static_cast<double>(step.repeat) * std::max(1.0, cycles_of(step.steps));
    return cycles;
}

}  // namespace

Scallops scallops(std::span<const double> openings, double step, double spacing) {
    std::vector<double> half = half_wall(openings, step);
    const double slope = mean_slope(half);
    for (std::size_t k = 0; k < half.size(); ++k) half[k] -= slope * static_cast<double>(k);
    const std::vector<Edge> edges = edges_of(half, 0.05 * spacing);
    if (edges.size() < 2) return {};
    const auto count = static_cast<double>(edges.size() - 1);
    Scallops found{static_cast<double>(edges.back().at - edges.front().at) * step / count, 0.0};
    for (std::size_t k = 0; k + 1 < edges.size(); ++k)
        found.depth += depth_between(half, edges[k].at, edges[k + 1].at) / count;
    return found;
}

std::string scallop_note(const Recipe& recipe, const Json& metrology) {
    const double cycles = cycles_of(recipe.steps), pitch = number_of(metrology, "scallop_pitch"),
                 depth = number_of(metrology, "depth"), product = cycles * pitch;
    constexpr double kNear = 0.2;
    if (cycles == 0.0 || !(std::abs(product - depth) > kNear * depth)) return {};
    const std::string& length = recipe.domain.length_unit;
    return fmt::format(
        "scallop_pitch: {:g} cycles of {:.4g} {} are {:.4g} {}, but the depth is {:.4g} {}: some cycles have left no "
        "scallop of their own, or some scallops are finer than the grid",
        cycles, pitch, length, product, length, depth, length);
}

}  // namespace sidewall::app
