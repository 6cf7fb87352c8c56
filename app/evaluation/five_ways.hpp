#pragma once
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/evaluation/study_flux.hpp"
#include "flux/lateral.hpp"
#include "surface/triangle_mesh.hpp"

// Five ways to the flux on a surface, each to the same error at every depth: Monte Carlo ("top-down") on the
// raw mesh, the same averaged over neighbours, on a simplified mesh, and radiosity on the raw and on a
// simplified mesh.
namespace sidewall::app {

/// A simplified mesh of the surface.
struct SimplifiedMesh {
    std::string name;
    TriangleMesh mesh;
    double seconds = 0.0;  ///< CPU seconds that it took, features included
};

struct FiveWaysOptions {
    double rays = 2.5e6;                 ///< source rays of the top-down ways, both repeats together
    std::vector<double> stickings{0.1};  ///< of the neutrals
    double target = 0.02;                ///< relative error
    double reference_rays = 6e7;         ///< gathered for the reference, all repeats together
    const FluxPair* long_run =
        nullptr;  ///< top-down on the raw mesh with more rays, of the first sticking, if there is one
    /// Told what comes next; may throw.
    std::function<void(const std::string&)> before_turn = [](const std::string&) {};
};

/// Measures the five ways. The reference is radiosity on the raw mesh with many more rays, as means over the vertices' hat
/// functions, which is what a tally counts; top-down on the raw mesh, which is unbiased, tells how far it is off: the longest
/// run there is, as "shift".
///
/// Of a way that can be had in several variants (rounds of averaging, simplified meshes) the best is marked: the one that is
/// first at every depth, or gets there at the most depths.
/// \returns one entry a sticking: {"sticking", "target", "depths": [{"name", "z_low", "z_high", "flux",
///          "reference_error", "shift"}], "ways": [{"way", "variant", "best", "rays", "run_seconds": {"fixed", "of_rays"},
///          "by_depth": [{"bias", "bias_resolved", "noise", "shift", "rays", "seconds"}], "seconds", "reached"}]}, see DepthError.
///          Seconds are null where the bias alone exceeds the target; those of a way are to the target at every depth,
///          "reached" counts the depths that get there. Radiosity has more and more rays: those of a depth, and
///          its noise, are of the first run that gets there; "rays" and "run_seconds" of a way are of its longest.
Json five_ways(const TriangleMesh& surface, const flux::LateralBox& box,
               std::span<const SimplifiedMesh> simplified, const FiveWaysOptions& options);

/// Markdown: whether simplification pays, a row a surface and sticking; empty for a study without five ways.
std::string five_ways_verdicts(const Json& study);

/// The table of one entry, in Markdown.
std::string five_ways_report(const Json& entry);

/// All of a study's as comma separated values.
std::string five_ways_csv(const Json& study);

/// Time by depth as an SVG, by file name, of a surface of study.json.
std::vector<std::pair<std::string, std::string>> five_ways_figures(const Json& surface);

}  // namespace sidewall::app
