#include "flux/tally.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace sidewall::flux {
namespace {

// One arrival in fixed point. 2^40 arrivals fit a wedge and a batch.
constexpr std::uint64_t kOne = std::uint64_t{1} << 24;

std::uint64_t fixed(double weight, std::uint64_t limit) {
    return std::min(limit,
                    static_cast<std::uint64_t>(std::max(0.0, weight) * static_cast<double>(kOne) + 0.5));
}

void add_relaxed(std::uint64_t& total, std::uint64_t amount) {
    std::atomic_ref(total).fetch_add(amount, std::memory_order_relaxed);
}

}  // namespace

Tally::Tally(const TriangleMesh& mesh, const Wedges& wedges)
    : mesh_(mesh),
      wedges_(wedges),
      triangle_hits_(mesh.triangles.size(), 0),
      wedge_weights_(wedges.count(), 0),
      triangles_(mesh.triangles.size()),
      by_wedge_(wedges.count()),
      by_vertex_(mesh.vertices.size()) {}

void Tally::add(std::uint32_t triangle, double u, double v) {
    const std::uint64_t second = fixed(u, kOne), third = fixed(v, kOne - second);
    const std::uint32_t* corner = &wedges_.corner[3 * std::size_t{triangle}];
    add_relaxed(triangle_hits_[triangle], 1);
    add_relaxed(wedge_weights_[corner[0]], kOne - second - third);
    add_relaxed(wedge_weights_[corner[1]], second);
    add_relaxed(wedge_weights_[corner[2]], third);
}

void Tally::close_batch() {
    ++batches_;
    tbb::parallel_for(tbb::blocked_range(std::size_t{0}, triangle_hits_.size(), 4096),
                      [&](const auto& range) {
                          for (std::size_t t = range.begin(); t < range.end(); ++t) {
                              if (triangle_hits_[t] == 0) continue;
                              triangles_.add(t, static_cast<double>(triangle_hits_[t]));
                              triangle_hits_[t] = 0;
                          }
                      });
    tbb::parallel_for(
        tbb::blocked_range(std::size_t{0}, mesh_.vertices.size(), 4096), [&](const auto& range) {
            for (std::size_t v = range.begin(); v < range.end(); ++v) {
                std::uint64_t vertex_weight = 0;
                for (std::uint32_t w = wedges_.first[v]; w < wedges_.first[v + 1]; ++w) {
                    by_wedge_.add(w, static_cast<double>(wedge_weights_[w]) / static_cast<double>(kOne));
                    vertex_weight += wedge_weights_[w];
                    wedge_weights_[w] = 0;
                }
                by_vertex_.add(v, static_cast<double>(vertex_weight) / static_cast<double>(kOne));
            }
        });
}

FluxField Tally::flux_of(const Sums& sums, const std::vector<double>& area, double area_per_ray) const {
    FluxField field{std::vector<double>(area.size(), 0.0), std::vector<double>(area.size(), 0.0)};
    const double batches = batches_;
    for (std::size_t i = 0; i < area.size(); ++i) {
        if (!(area[i] > 0.0)) continue;
        const double scale = area_per_ray / area[i];
        const double spread = sums.squares[i] - sums.sum[i] * sums.sum[i] / batches;
        field.flux[i] = sums.sum[i] * scale;
        field.error[i] = std::sqrt(std::max(0.0, spread) * batches / (batches - 1.0)) * scale;
    }
    return field;
}

FluxField Tally::triangle_flux(double area_per_ray) const {
    std::vector<double> area(mesh_.triangles.size());
    for (std::size_t t = 0; t < area.size(); ++t) area[t] = triangle_area(mesh_, t);
    return flux_of(triangles_, area, area_per_ray);
}

FluxField Tally::wedge_flux(double area_per_ray) const {
    return flux_of(by_wedge_, wedges_.area, area_per_ray);
}

FluxField Tally::vertex_flux(double area_per_ray) const {
    std::vector<double> area(mesh_.vertices.size(), 0.0);
    for (std::size_t v = 0; v < area.size(); ++v)
        for (std::uint32_t w = wedges_.first[v]; w < wedges_.first[v + 1]; ++w) area[v] += wedges_.area[w];
    return flux_of(by_vertex_, area, area_per_ray);
}

}  // namespace sidewall::flux
