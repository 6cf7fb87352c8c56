#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::bench {

using app::Json;

/// Repeats of one method ("way") with other random numbers: fluxes at the vertices of the surface under
/// study.
struct FluxRuns {
    std::vector<std::vector<double>> values;  ///< one vector a repeat
    std::vector<std::vector<double>> limit;   ///< limit of many rays, in as many repeats as the reference
    double rays = 0.0;                        ///< rays of one repeat
    double fewest_rays = 1.0;                 ///< fewest rays that the method can take
    double seconds = 0.0;        ///< CPU seconds of one repeat, the part that is proportional to its rays
    double fixed_seconds = 0.0;  ///< the other CPU seconds: simplification, hierarchy, averaging
};

/// Vertices of a surface at about the same depth, each with the area that is nearest to it.
struct DepthBin {
    std::string name;
    std::vector<std::uint32_t> vertices;
    std::vector<double> area;
};

/// Bins by tenths of the depth from the top down, then the floor: the upward faces of the lowest tenth.
/// \note A bin without vertices is left out.
std::vector<DepthBin> depth_bins(const TriangleMesh& surface);

/// Relative errors of a method at one depth, root mean squares over its area.
struct DepthError {
    double flux = 0.0;             ///< mean of the reference
    double bias = 0.0;             ///< error of the limit, which more rays do not reduce
    double noise = 0.0;            ///< deviation of one repeat from the limit
    double reference_error = 0.0;  ///< standard deviation of the mean of the reference's repeats
    double shift = 0.0;            ///< mean flux of the repeats over that of the reference, less 1
    double rays = kInfinity;       ///< rays of a run to the target; infinite if the bias alone is as large
    double seconds = kInfinity;    ///< CPU seconds of that run, end to end
};

/// The error of \p runs against a reference of several repeats, and the cost of a relative error of \p
/// target. The repeats' variance is subtracted from all squares: the reference's noise is no part of bias and
/// noise.
DepthError depth_error(const DepthBin& bin, const FluxRuns& runs,
                       std::span<const std::vector<double>> reference, double target);

/// A mesh of the surface, simplified or as it was extracted.
struct SimplifiedMesh {
    std::string name;
    TriangleMesh mesh;
    double seconds = 0.0;  ///< CPU seconds of its simplification, features included
};

struct FiveWaysOptions {
    double rays = 2.5e6;                       ///< source rays of the top-down ways, both repeats together
    std::vector<double> stickings{0.1, 0.01};  ///< sticking probabilities of the neutrals
    double target = 0.02;                      ///< relative error
    double reference_rays = 6e7;               ///< rays of the reference, all repeats together
    /// Called before each calculation with its name; may throw.
    std::function<void(const std::string&)> before_turn = [](const std::string&) {};
};

/// Measures the CPU seconds of five methods for the flux on a surface, each to the same error at every depth:
/// Monte Carlo from the source ("top-down") on the raw mesh, the same averaged over neighbours, top-down on a
/// simplified mesh, and radiosity on the raw and on a simplified mesh. The reference is radiosity on the raw
/// mesh with many more rays, as means over the vertices' hat functions, which is what a tally counts.
/// Top-down on the raw mesh is unbiased and checks its mean ("shift").
///
/// Where a method has several variants (rounds of averaging, simplified meshes) the best is marked: the
/// fastest, or the least biased where none reaches the target. Radiosity is run with more and more rays until
/// it does.
/// \param meshes  the raw one first.
/// \returns one entry a sticking: {"sticking", "target", "ways": [{"way", "variant", "best", "rays",
///          "run_seconds": {"fixed", "of_rays"}, "by_depth": [{"depth", "flux", "reference_error", "bias",
///          "noise", "shift", "seconds"}], "bias", "seconds"}]}, see DepthError; seconds are null where
///          infinite; a way's bias and seconds are those of its worst depth.
Json five_ways(std::span<const SimplifiedMesh> meshes, const flux::LateralBox& box,
               const FiveWaysOptions& options);

/// The entries of five_ways in Markdown, a row a sticking: CPU seconds of each method's best variant, the
/// variant in brackets and, where the target is not reached, the remaining error with any number of rays;
/// last, how many times faster the fastest method with simplification is than the fastest without.
std::string five_ways_table(const std::string& surface, const Json& entries);

/// An entry of five_ways in Markdown: CPU seconds of the best variant of each method, a row a depth.
std::string depth_table(const Json& entry);

/// A mesh on which a neutral's fluxes are calculated, to be read at the vertices of another mesh of the same
/// surface. Keeps a reference to the mesh.
struct MeshFlux {
    MeshFlux(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box);

    /// The flux by wedge, by Monte Carlo tracing from the source.
    /// \param seconds  grows by the CPU seconds of all threads: what else runs on the machine weighs little.
    std::vector<double> traced(double rays, double sticking, std::uint64_t seed, double& seconds) const;
    /// The flux by wedge, by radiosity: traces \p rays between points of the mesh and solves the sparse
    /// system.
    /// \param errors  estimates the standard errors, too.
    std::vector<double> solved(double rays, double sticking, std::uint64_t seed, bool errors,
                               double& seconds) const;
    /// The quantity \p by_wedge at the vertices of the surface, linear over the nearest triangle of the mesh.
    std::vector<double> at_vertices(std::span<const double> by_wedge) const;

    double bvh_seconds = 0.0;    ///< CPU seconds to build the hierarchy
    double wedge_seconds = 0.0;  ///< CPU seconds to find creases
    const TriangleMesh& mesh;
    flux::LateralBox box;
    surface::RayScene scene;
    flux::Wedges wedges;
    std::vector<surface::SurfaceHit> nearest;  ///< closest points of the mesh to the surface's vertices
};

/// Averages each vertex's value with its neighbours', area-weighted, \p rounds times; creases are not
/// crossed.
std::vector<double> smoothed(std::vector<double> values, const TriangleMesh& surface, int rounds);

}  // namespace sidewall::bench
