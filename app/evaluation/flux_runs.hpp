#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"

// How long a way to a flux takes to an error at every depth, from a few repeats of it.
namespace sidewall::app {

/// Repeats of one way to a flux, with the same rays but other random numbers, as values at the vertices of the surface under
/// study. Seconds are CPU seconds of all threads.
struct FluxRuns {
    std::vector<std::vector<double>> values;  ///< one a repeat
    std::vector<std::vector<double>>
        limit;                 ///< what it comes to with ever more rays, in as many repeats as the reference
    double rays = 0.0;         ///< of one repeat
    double fewest_rays = 1.0;  ///< that the way can take
    double seconds = 0.0;      ///< of one repeat, those that grow as its rays
    double fixed_seconds = 0.0;  ///< and those that do not: of simplification, hierarchy, averaging
};

/// Vertices of a surface at about the same depth, each with the area that is nearest to it.
struct DepthBin {
    std::string name;
    double z_low = 0.0, z_high = 0.0;  ///< length unit
    std::vector<std::uint32_t> vertices;
    std::vector<double> area;
};

/// The tenths of the depth from the top down, without the floor: what faces up in the lowest tenth, which comes last.
/// \note A bin without vertices is left out.
std::vector<DepthBin> depth_bins(const TriangleMesh& surface);

/// Relative errors of a way at one depth, root mean squares over its area.
struct DepthError {
    double flux = 0.0;             ///< of the reference, mean
    double bias = 0.0;             ///< of the limit: what more rays do not mend
    double bias_resolved = 0.0;    ///< root of the standard error of its square: smaller ones do not show
    double noise = 0.0;            ///< of one repeat against the limit
    double reference_error = 0.0;  ///< standard deviation of the mean of the reference's repeats
    double shift = 0.0;            ///< mean flux of the repeats over that of the reference, less 1
};

/// The error of \p runs against a reference of several repeats. The variances that repeats show are taken off all squares: a
/// noisy reference makes no bias, and no noise.
DepthError depth_error(const DepthBin& bin, const FluxRuns& runs,
                       std::span<const std::vector<double>> reference);

/// CPU seconds of one run to a relative error of \p target, noise falling with the root of the rays; infinity if the bias
/// alone is as large.
/// \param rays  set to the rays it takes.
double seconds_to(double target, const FluxRuns& runs, const DepthError& error, double& rays);

}  // namespace sidewall::app
