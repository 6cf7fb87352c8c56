#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "levelset/domain.hpp"

// Functions of x and y on pixels, and their convolution with Gaussians.
namespace sidewall::levelset {

/// Pixels that divide the domain; values in rows along x.
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

/// The pixel within the domain that shows what a pixel beyond it does, mirrored or wrapped.
int source_pixel(const Raster& raster, const Domain& domain, std::size_t axis, int index);

/// Pixels that a Gaussian's standard deviation is divided into, at least.
inline constexpr double kPixelsPerSigma = 5.0;

/// Multiplications of add_blurred for each pixel of a raster, roughly.
double blur_work(double sigma, double pixel);

/// Adds \p weight times what a Gaussian makes of \p covered to \p sum, a raster of the same pixels. The Gaussian's weights
/// are exact for what is constant on pixels, up to 5.5 sigma away. A wide one takes the means over pixels of a fifth of
/// its sigma and is interpolated linearly between them, which errs by 0.0012 beside a straight edge and keeps its cost that
/// of a narrow one.
/// \note Parallel; the same bits on any number of threads.
void add_blurred(const Raster& covered, double sigma, double weight, const Domain& domain, Raster& sum);

}  // namespace sidewall::levelset
