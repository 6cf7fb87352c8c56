#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// One flux calculation repeated with another seed, as values at the vertices of the surface under study. Seconds are CPU
/// seconds of all threads: what else runs on the machine weighs little.
struct FluxPair {
    std::vector<double> first, second;
    double bvh_seconds = 0.0;
    double wedge_seconds = 0.0;  ///< to find creases
    double trace_seconds = 0.0;  ///< of both
    double rays = 0.0;           ///< of both
    double segments = 0.0;       ///< of both
};

/// The surface that fluxes are compared on, and the flux that counts as true there.
struct FluxTruth {
    const TriangleMesh* surface = nullptr;
    flux::LateralBox box;
    std::vector<double> vertex_area;
    FluxPair flux;
};

/// A neutral of some sticking on \p mesh, traced twice with half of the rays each, as the fluxes at the vertices of \p surface,
/// linear over the nearest triangle: turn by turn, so that several meshes can take turns.
class PairTrace {
  public:
    /// Builds the hierarchy. Keeps references to both meshes.
    PairTrace(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box);

    /// One of the two.
    /// \param rays       of both together.
    /// \param radiosity  gathers the rays between points of the mesh and solves; the seconds are of both.
    void turn(double rays, double sticking, std::uint64_t seed, bool radiosity = false);
    /// Gives the pair away and begins another; it keeps the seconds of hierarchy and creases.
    FluxPair take();

    const TriangleMesh& mesh() const { return mesh_; }
    const flux::LateralBox& box() const { return box_; }
    const surface::RayScene& scene() const { return scene_; }
    const flux::Wedges& wedges() const { return wedges_; }
    /// A quantity by wedge, at the vertices of the surface.
    std::vector<double> at_vertices(std::span<const double> by_wedge) const;

    FluxPair pair;

  private:
    // The point of the mesh that a vertex of the surface reads its flux from.
    struct Foot {
        std::uint32_t triangle;
        double u, v;
    };
    const TriangleMesh& mesh_;
    flux::LateralBox box_;
    surface::RayScene scene_;
    flux::Wedges wedges_;
    std::vector<Foot> feet_;
};

/// Both turns of a PairTrace.
FluxPair trace_pair(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box,
                    double rays, double sticking, std::uint64_t seed, bool radiosity = false);

/// Traces \p surface itself, for the truth. Keeps a reference to \p surface.
FluxTruth make_truth(const TriangleMesh& surface, const flux::LateralBox& box, double rays, double sticking);

/// Averages each vertex's values with its neighbours', area-weighted, \p rounds times; creases are not
/// crossed.
std::vector<double> smoothed(std::vector<double> values, const TriangleMesh& surface, int rounds);
FluxPair smoothed(const FluxPair& pair, const TriangleMesh& surface, int rounds);  ///< both

/// Error of a flux against the truth, relative L2 over the surface, split without bias: the mean of the
/// product of two independent errors is the squared bias, half the mean squared difference of two runs the
/// variance.
///
/// \returns {"bias", "noise" (standard deviation, at the pair's rays together), "error", "rays_to_error"
/// (null
///          if the bias alone exceeds \p target), "seconds_to_error" (tracing only), "by_depth": [{"z_low",
///          "z_high", "flux", "bias", "noise"}] in five equal slices from the bottom}.
Json flux_error(const FluxPair& pair, const FluxTruth& truth, double target);

}  // namespace sidewall::app
