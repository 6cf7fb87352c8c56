#include "app/evaluation/flux_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

constexpr int kTenths = 10;
constexpr double kFacesUp = 0.707;  // cosine of 45 degrees

// Mean of some repeats, and its variance.
struct Mean {
    double value = 0.0, variance = 0.0;
};

// Of value(repeat).
template <class Value>
Mean mean_over(std::size_t repeats, const Value& value) {
    const auto count = static_cast<double>(repeats);
    Mean mean;
    for (std::size_t k = 0; k < repeats; ++k) mean.value += value(k) / count;
    for (std::size_t k = 0; k < repeats; ++k)
        mean.variance += std::pow(value(k) - mean.value, 2.0) / (count * std::max(1.0, count - 1.0));
    return mean;
}

}  // namespace

std::vector<DepthBin> depth_bins(const TriangleMesh& surface) {
    std::vector<Vec3> normal(surface.vertices.size(), Vec3::Zero());
    std::vector<double> area(surface.vertices.size(), 0.0);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t]) {
            normal[v] += area_vector(surface, t);
            area[v] += triangle_area(surface, t) / 3.0;
        }
    const Box3 box = bounding_box(surface);
    const double step = box.size().z() / kTenths;
    std::vector<DepthBin> bins;
    bins.reserve(kTenths + 1);
    for (int tenth = 0; tenth < kTenths; ++tenth)
        bins.push_back({fmt::format("{} to {} %", 10 * tenth, 10 * (tenth + 1)),
                        box.max.z() - step * (tenth + 1),
                        box.max.z() - step * tenth,
                        {},
                        {}});
    bins.push_back({"floor", bins.back().z_low, bins.back().z_high, {}, {}});
    for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
        const double below = box.max.z() - surface.vertices[v].z();
        const int tenth = step > 0.0 ? std::min(kTenths - 1, static_cast<int>(below / step)) : kTenths - 1;
        const bool floor = tenth == kTenths - 1 && normal[v].z() > kFacesUp * normal[v].norm();
        DepthBin& bin = floor ? bins.back() : bins[static_cast<std::size_t>(tenth)];
        bin.vertices.push_back(v);
        bin.area.push_back(area[v]);
    }
    std::erase_if(bins, [](const DepthBin& bin) { return bin.vertices.empty(); });
    return bins;
}

DepthError depth_error(const DepthBin& bin, const FluxRuns& runs,
                       std::span<const std::vector<double>> reference) {
    const std::size_t repeats = reference.size();
    const auto count = static_cast<double>(runs.values.size());
    double area = 0.0, flux = 0.0, own = 0.0, square = 0.0, noise = 0.0, unsure = 0.0;
    std::vector<double> products(repeats * (repeats - 1) / 2, 0.0);  // of the deviations in two repeats
    for (std::size_t i = 0; i < bin.vertices.size(); ++i) {
        const std::uint32_t v = bin.vertices[i];
        const double a = bin.area[i];
        const Mean truth = mean_over(repeats, [&](std::size_t k) { return reference[k][v]; }),
                   goal = mean_over(repeats, [&](std::size_t k) { return runs.limit[k][v]; });
        area += a;
        flux += a * truth.value;
        square += a * (truth.value * truth.value - truth.variance);
        unsure += a * truth.variance;
        auto product = products.begin();
        for (std::size_t k = 0; k < repeats; ++k)
            for (std::size_t j = 0; j < k; ++j)
                *product++ += a * (runs.limit[k][v] - reference[k][v]) * (runs.limit[j][v] - reference[j][v]);
        for (const std::vector<double>& repeat : runs.values) {
            own += a * repeat[v] / count;
            noise += a * (std::pow(repeat[v] - goal.value, 2.0) - goal.variance) / count;
        }
    }
    const auto relative = [&](double sum) {
        return square > 0.0 ? std::sqrt(std::max(0.0, sum) / square) : kInfinity;
    };
    const Mean bias = mean_over(products.size(), [&](std::size_t k) { return products[k]; });
    return {.flux = flux / area,
            .bias = relative(bias.value),
            .bias_resolved = relative(std::sqrt(bias.variance)),
            .noise = relative(noise),
            .reference_error = relative(unsure),
            .shift = own / flux - 1.0};
}

double seconds_to(double target, const FluxRuns& runs, const DepthError& error, double& rays) {
    const double left = target * target - error.bias * error.bias;
    rays = left > 0.0 ? std::max(runs.fewest_rays, runs.rays * error.noise * error.noise / left) : kInfinity;
    return left > 0.0 ? runs.fixed_seconds + runs.seconds * rays / runs.rays : kInfinity;
}

}  // namespace sidewall::app
