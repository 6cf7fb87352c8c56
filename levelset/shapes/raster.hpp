#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "levelset/domain.hpp"

// Functions of x and y on pixels, and their convolution with Gaussians.
namespace sidewall::levelset {

/// A function on pixels that divide the domain; values in rows along x.
struct Raster {
    std::array<int, 2> count{};
    std::array<double, 2> size{};
    std::vector<float> values;

    std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(count[0]) + static_cast<std::size_t>(i);
    }
    /// Sets all values to 0.
    void clear() { values.assign(index(0, count[1]), 0.0f); }
    float* row(int j) { return values.data() + index(0, j); }
    const float* row(int j) const { return values.data() + index(0, j); }
    float at(int i, int j) const { return values[index(i, j)]; }
};

/// The pixel within the domain whose value a pixel beyond it repeats, mirrored or wrapped.
int source_pixel(const Raster& raster, const Domain& domain, std::size_t axis, int index);

/// Pixels per standard deviation of a Gaussian, at least; fewer only if the raster itself is coarser.
inline constexpr double kPixelsPerSigma = 5.0;

/// Rough number of multiplications of add_blurred per pixel of a raster.
double blur_work(double sigma, double pixel);

/// Adds \p weight times the convolution of \p covered with a Gaussian to \p sum, a raster of the same pixels.
/// The weights are exact for functions constant on pixels, up to 5.5 sigma away. A wide Gaussian acts on
/// means over pixels of a fifth of its sigma, and its result is interpolated linearly: this errs by 0.0012
/// beside a straight edge and costs no more than a narrow one.
/// \note Parallel; the same bits on any number of threads.
void add_blurred(const Raster& covered, double sigma, double weight, const Domain& domain, Raster& sum);

}  // namespace sidewall::levelset
