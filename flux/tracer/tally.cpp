#include "flux/tracer/tally.hpp"

#include <sys/mman.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "surface/parallel.hpp"

namespace sidewall::flux {
namespace {

constexpr std::size_t kGroup = 8;  // bins tested together: in a sparse batch nearly all are empty

// Empties the bins of elements [first, last) of all threads and calls use(element, sum). Groups of bins that
// are all empty are skipped; single zeros are not, as a branch on each would cost more.
template <class Use>
void take(const std::vector<std::uint64_t*>& bins, std::size_t first, std::size_t last, const Use& use) {
    for (std::size_t group = first; group < last; group += kGroup) {
        const std::size_t end = std::min(last, group + kGroup);
        std::uint64_t any = end < group + kGroup ? 1 : 0;  // an incomplete group is never skipped
        if (any == 0)
            for (const std::uint64_t* bin : bins)
                for (std::size_t k = 0; k < kGroup; ++k) any |= bin[group + k];
        if (any == 0) continue;
        for (std::size_t i = group; i < end; ++i) {
            std::uint64_t sum = 0;
            for (std::uint64_t* bin : bins) {
                sum += bin[i];
                bin[i] = 0;
            }
            use(i, sum);
        }
    }
}

// Allocates zeroed bins, on huge pages where the system has them, as access is random.
void allocate(std::vector<std::uint64_t>& bins, std::size_t count) {
    bins.reserve(count);
#ifdef MADV_HUGEPAGE
    constexpr std::uintptr_t kPage = 4096;
    const auto begin = reinterpret_cast<std::uintptr_t>(bins.data()) / kPage * kPage + kPage;
    const auto end = reinterpret_cast<std::uintptr_t>(bins.data() + count) / kPage * kPage;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): madvise wants whole pages
    if (end > begin) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
    bins.resize(count, 0);
}

constexpr std::size_t kTask = 8192;  // elements in a parallel task, at least

template <class Body>
void for_ranges(std::size_t count, const Body& body) {
    tbb::parallel_for(tbb::blocked_range(std::size_t{0}, count, kTask),
                      [&](const auto& range) { body(range.begin(), range.end()); });
}

std::vector<std::uint32_t> split_vertices(const Wedges& wedges) {
    std::vector<std::uint32_t> split;
    for (std::uint32_t v = 0; v + 1 < wedges.first.size(); ++v)
        if (wedges.first[v + 1] - wedges.first[v] > 1) split.push_back(v);
    return split;
}

}  // namespace

Tally::Tally(const TriangleMesh& mesh, const Wedges& wedges)
    : mesh_(mesh),
      wedges_(wedges),
      split_(split_vertices(wedges)),
      triangles_(mesh.triangles.size()),
      by_wedge_(wedges.count()),
      by_split_(split_.size()) {}

Tally::Bins& Tally::bins() {
    Bins& bins = bins_.local();
    if (bins.triangle.empty()) {
        allocate(bins.triangle, mesh_.triangles.size());
        allocate(bins.wedge, wedges_.count());
    }
    return bins;
}

void Tally::close_batch() {
    std::vector<std::uint64_t*> triangle, wedge;
    for (Bins& bins : bins_) {
        triangle.push_back(bins.triangle.data());
        wedge.push_back(bins.wedge.data());
    }
    close_batch(triangle, wedge);
}

void Tally::close_batch(std::span<std::uint64_t> words) {
    close_batch({words.data()}, {words.data() + triangles_.round.size()});
}

void Tally::take_batch(std::vector<std::uint64_t>& words) {
    const std::size_t at = words.size(), triangles = triangles_.round.size();
    words.resize(at + bin_count(), 0);
    const auto move = [&](std::vector<std::uint64_t> Bins::*bins, std::uint64_t* sums, std::size_t count) {
        std::vector<std::uint64_t*> from;
        for (Bins& own : bins_) from.push_back((own.*bins).data());
        for_ranges(count, [&](std::size_t first, std::size_t last) {
            take(from, first, last, [&](std::size_t i, std::uint64_t sum) { sums[i] = sum; });
        });
    };
    move(&Bins::triangle, words.data() + at, triangles);
    move(&Bins::wedge, words.data() + at + triangles, by_wedge_.round.size());
}

void Tally::close_batch(const std::vector<std::uint64_t*>& triangle,
                        const std::vector<std::uint64_t*>& wedge) {
    ++batches_;
    for_ranges(mesh_.triangles.size(), [&](std::size_t first, std::size_t last) {
        take(triangle, first, last, [&](std::size_t t, std::uint64_t sum) { triangles_.round[t].add(sum); });
    });
    // Sum over the wedges of split vertices, before the wedges' bins are emptied.
    surface::parallel_each(split_.size(), kTask, [&](std::size_t i) {
        std::uint64_t vertex = 0;
        for (std::uint32_t w = wedges_.first[split_[i]]; w < wedges_.first[split_[i] + 1]; ++w)
            for (const std::uint64_t* bins : wedge) vertex += bins[w];
        if (vertex > 0) by_split_.round[i].add(vertex);
    });
    for_ranges(wedges_.count(), [&](std::size_t first, std::size_t last) {
        take(wedge, first, last, [&](std::size_t w, std::uint64_t sum) { by_wedge_.round[w].add(sum); });
    });
}

void Tally::close_round() {
    const double batches = batches_;
    // The root of an unbiased variance is too small on average: for normal numbers by the factor c4, the mean
    // of chi over sqrt(batches - 1). At 16 batches that is 1.6 %, which is not corrected.
    constexpr double kMany = 16.0;
    const double short_by = batches < kMany ? std::sqrt(2.0 / (batches - 1.0)) * std::tgamma(0.5 * batches) /
                                                  std::tgamma(0.5 * (batches - 1.0))
                                            : 1.0;
    for (Sums* sums : {&triangles_, &by_wedge_, &by_split_})
        surface::parallel_each(sums->round.size(), kTask, [&](std::size_t i) {
            Sum& round = sums->round[i];
            if (round.sum == 0.0) return;
            const double spread = round.squares - round.sum * round.sum / batches;
            sums->total[i].sum += round.sum;
            sums->total[i].variance +=
                std::max(0.0, spread) * batches / (batches - 1.0) / (short_by * short_by);
            round = {};
        });
    batches_ = 0;
}

FluxField Tally::flux_of(const Sums& sums, const std::vector<double>& area, double area_per_ray) {
    FluxField field{std::vector<double>(area.size(), 0.0), std::vector<double>(area.size(), 0.0)};
    surface::parallel_each(area.size(), kTask, [&](std::size_t i) {
        if (!(area[i] > 0.0)) return;
        const double scale = area_per_ray / area[i];
        field.flux[i] = sums.total[i].sum * scale;
        field.error[i] = std::sqrt(sums.total[i].variance) * scale;
    });
    return field;
}

FluxField Tally::triangle_flux(double area_per_ray) const {
    std::vector<double> area(mesh_.triangles.size());
    surface::parallel_each(area.size(), kTask, [&](std::size_t t) { area[t] = triangle_area(mesh_, t); });
    return flux_of(triangles_, area, area_per_ray);
}

FluxField Tally::wedge_flux(double area_per_ray) const {
    return flux_of(by_wedge_, wedges_.area, area_per_ray);
}

FluxField Tally::vertex_flux(double area_per_ray) const {
    FluxField field{std::vector<double>(mesh_.vertices.size(), 0.0),
                    std::vector<double>(mesh_.vertices.size(), 0.0)};
    const auto set = [&](std::size_t v, double area, const Total& total) {
        if (!(area > 0.0)) return;
        field.flux[v] = total.sum * area_per_ray / area;
        field.error[v] = std::sqrt(total.variance) * area_per_ray / area;
    };
    surface::parallel_each(mesh_.vertices.size(), kTask, [&](std::size_t v) {
        const std::uint32_t w = wedges_.first[v];
        if (wedges_.first[v + 1] - w == 1) set(v, wedges_.area[w], by_wedge_.total[w]);
    });
    for (std::size_t i = 0; i < split_.size(); ++i) {
        double area = 0.0;
        for (std::uint32_t w = wedges_.first[split_[i]]; w < wedges_.first[split_[i] + 1]; ++w)
            area += wedges_.area[w];
        set(split_[i], area, by_split_.total[i]);
    }
    return field;
}

}  // namespace sidewall::flux
