#include "levelset/shapes/raster.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace sidewall::levelset {
namespace {

constexpr double kBlurReach = 5.5;     // in sigmas; a share of 4e-8 lies beyond
constexpr double kLeastCoarser = 2.0;  // ratio of pixel sizes; smaller ones are not worth it

// The pixel size that a Gaussian needs over that of a raster; 1 if the raster's is about as large.
double times_coarser(double sigma, double pixel) {
    const double times = sigma / (kPixelsPerSigma * pixel);
    return times < kLeastCoarser ? 1.0 : times;
}

// Integrals over pixels in a row, up to 5.5 sigma away, of a Gaussian at a pixel's centre; their sum is 1.
std::vector<float> weights_of(double sigma, double pixel) {
    const int reach = static_cast<int>(std::ceil(kBlurReach * sigma / pixel));
    std::vector<double> exact;
    exact.reserve(static_cast<std::size_t>(2 * reach + 1));
    for (int k = -reach; k <= reach; ++k)
        exact.push_back(0.5 * (std::erf((k + 0.5) * pixel / (sigma * std::numbers::sqrt2)) -
                               std::erf((k - 0.5) * pixel / (sigma * std::numbers::sqrt2))));
    const double sum = std::accumulate(exact.begin(), exact.end(), 0.0);
    std::vector<float> weights;
    weights.reserve(exact.size());
    for (const double w : exact) weights.push_back(static_cast<float>(w / sum));
    return weights;
}

// Convolves along x, then along y, whole rows at a time; adds \p weight times the result to \p sum.
void add_on_pixels(const Raster& covered, double sigma, double weight, const Domain& domain, Raster& sum) {
    Raster along_x = covered;
    const int nx = covered.count[0], ny = covered.count[1];
    const std::vector<float> wx = weights_of(sigma, covered.size[0]), wy = weights_of(sigma, covered.size[1]);
    const int rx = static_cast<int>(wx.size()) / 2, ry = static_cast<int>(wy.size()) / 2;
    const auto add = [](float* to, const float* from, float w, int n) {
        for (int i = 0; i < n; ++i) to[i] += w * from[i];
    };
    tbb::parallel_for(0, ny, [&](int j) {
        std::vector<float> line;
        for (int i = -rx; i < nx + rx; ++i)
            line.push_back(covered.at(source_pixel(covered, domain, 0, i), j));
        float* row = along_x.row(j);
        std::fill_n(row, nx, 0.0f);
        for (int k = 0; k <= 2 * rx; ++k) add(row, line.data() + k, wx[static_cast<std::size_t>(k)], nx);
    });
    tbb::parallel_for(0, ny, [&](int j) {
        std::vector<float> row(static_cast<std::size_t>(nx), 0.0f);
        for (int k = -ry; k <= ry; ++k)
            add(row.data(), along_x.row(source_pixel(covered, domain, 1, j + k)),
                wy[static_cast<std::size_t>(k + ry)], nx);
        add(sum.row(j), row.data(), static_cast<float>(weight), nx);
    });
}

// The means of a raster over pixels \p times as large along either axis, or a little smaller, so that whole
// numbers of them divide the domain.
Raster coarser(const Raster& fine, double times) {
    Raster coarse;
    std::array<double, 2> ratio{};
    for (std::size_t a = 0; a < 2; ++a) {
        coarse.count[a] = static_cast<int>(std::ceil(fine.count[a] / times - 1e-9));
        ratio[a] = static_cast<double>(fine.count[a]) / coarse.count[a];
        coarse.size[a] = ratio[a] * fine.size[a];
    }
    coarse.clear();
    // The share of coarse pixel n that fine pixel k covers along axis a.
    const auto share = [&](std::size_t a, int n, int k) {
        return std::max(0.0, std::min(k + 1.0, (n + 1) * ratio[a]) - std::max<double>(k, n * ratio[a])) /
               ratio[a];
    };
    const auto first = [&](std::size_t a, int n) { return static_cast<int>(n * ratio[a]); };
    const auto last = [&](std::size_t a, int n) {
        return std::min(static_cast<int>(std::ceil((n + 1) * ratio[a])), fine.count[a]);
    };
    tbb::parallel_for(0, coarse.count[1], [&](int j) {
        for (int i = 0; i < coarse.count[0]; ++i) {
            double sum = 0.0;
            for (int l = first(1, j); l < last(1, j); ++l) {
                double row = 0.0;
                for (int k = first(0, i); k < last(0, i); ++k)
                    row += share(0, i, k) * static_cast<double>(fine.at(k, l));
                sum += share(1, j, l) * row;
            }
            coarse.row(j)[i] = static_cast<float>(sum);
        }
    });
    return coarse;
}

// Adds \p weight times a coarser raster, interpolated linearly between the centres of its pixels.
void add_between(const Raster& coarse, double weight, const Domain& domain, Raster& sum) {
    struct Place {
        int low, high;
        float t;  // weight of high
    };
    const auto place = [&](std::size_t a, int k) {
        const double at = (k + 0.5) * coarse.count[a] / sum.count[a] - 0.5, low = std::floor(at);
        const int n = static_cast<int>(low);
        return Place{source_pixel(coarse, domain, a, n), source_pixel(coarse, domain, a, n + 1),
                     static_cast<float>(at - low)};
    };
    std::vector<Place> along;
    along.reserve(static_cast<std::size_t>(sum.count[0]));
    for (int i = 0; i < sum.count[0]; ++i) along.push_back(place(0, i));
    const auto w = static_cast<float>(weight);
    tbb::parallel_for(0, sum.count[1], [&](int j) {
        const Place y = place(1, j);
        const float *low = coarse.row(y.low), *high = coarse.row(y.high);
        float* to = sum.row(j);
        for (const Place& x : along) {
            const float below = low[x.low] + x.t * (low[x.high] - low[x.low]),
                        above = high[x.low] + x.t * (high[x.high] - high[x.low]);
            *to++ += w * (below + y.t * (above - below));
        }
    });
}

}  // namespace

int source_pixel(const Raster& raster, const Domain& domain, std::size_t axis, int index) {
    const int n = raster.count[axis], period = domain.side[axis] == Side::periodic ? n : 2 * n;
    int i = index % period;
    if (i < 0) i += period;
    return i < n ? i : period - 1 - i;
}

double blur_work(double sigma, double pixel) {
    const double times = times_coarser(sigma, pixel);
    return 4.0 * kBlurReach * sigma / (pixel * times * times * times) + (times > 1.0 ? 2.0 : 0.0);
}

// On pixels of a fifth of its sigma a wide Gaussian is as exact as a narrow one, and costs the same.
void add_blurred(const Raster& covered, double sigma, double weight, const Domain& domain, Raster& sum) {
    const double times = times_coarser(sigma, std::max(covered.size[0], covered.size[1]));
    if (times == 1.0) return add_on_pixels(covered, sigma, weight, domain, sum);
    const Raster coarse = coarser(covered, times);
    Raster blurred = coarse;
    blurred.clear();
    add_on_pixels(coarse, sigma, 1.0, domain, blurred);
    add_between(blurred, weight, domain, sum);
}

}  // namespace sidewall::levelset
