#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/common/interrupt.hpp"
#include "flux/direct.hpp"
#include "flux/lateral.hpp"
#include "flux/shares.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"
#include "levelset/meshes/pieces.hpp"
#include "surface/error.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

// The types that the phases of a time step hand on: the surface, the request to trace it, what arrives.
namespace sidewall::app {

class ColumnSight;  // arriving/line_of_sight.hpp

/// How the flux of a species is found.
struct SpeciesMethod {
    std::string species;     ///< its name
    bool radiosity = false;  ///< else Monte Carlo
    std::string reason;      ///< of the choice, for a message; may be empty
    double target =
        0.0;            ///< relative error that radiosity is to reach instead of tracing [flux] rays; 0: none
    double rays = 0.0;  ///< an unknown that radiosity begins with; 0: as few as estimate errors
};

/// What tracing a surface yields beyond the fluxes that models see.
struct TraceReport {
    /// Raw results by Model::species. Of species solved by radiosity, emitted, segments and leaked count the
    /// rays gathered for all of them, which are one pass; where particles ended is not known.
    std::vector<flux::FluxResult> species;
    std::vector<SpeciesMethod> methods;      ///< by Model::species
    std::vector<std::vector<double>> error;  ///< standard errors of SurfaceFlux::flux, by tally and wedge
    int traces = 0;                          ///< it took until the coverages had settled
    double coverage_change = 0.0;            ///< mean change of a coverage in the last of them
};

/// What comes straight from a species' source, which turns with the surface's normal, and what does not.
struct DirectPart {
    std::shared_ptr<const flux::DirectFlux> source;
    std::size_t tally = 0;                  ///< the first of the species' tallies
    std::vector<std::vector<double>> open;  ///< by beam and wedge (flux::open_shares)
    std::vector<std::vector<double>> rest;  ///< by DirectFlux::tallies and wedge: hits after the first one
};

/// What arrives on a surface and what is adsorbed there. Every list is complete.
struct SurfaceFlux {
    std::vector<std::int32_t> materials;        ///< of the mesh's triangles
    flux::Wedges wedges;                        ///< the mesh's vertices split at creases and material edges
    std::vector<std::vector<double>> flux;      ///< what models see, by tally (flux_names) and wedge
    std::vector<DirectPart> direct;             ///< parts of flux
    std::vector<std::vector<double>> coverage;  ///< by Model::coverages and wedge
    std::optional<TraceReport> trace;           ///< absent where all is carried over from an earlier surface
};

/// The wafer's surface at one time, what is traced in its place, and what arrives on it.
struct TracedSurface {
    TriangleMesh raw;                            ///< as extracted
    std::vector<levelset::SurfacePiece> pieces;  ///< of raw
    std::optional<TriangleMesh> simplified;      ///< what is traced instead, if anything
    flux::LateralBox box;                        ///< sides of the domain
    std::optional<TriangleMesh> sector;          ///< of traced(), where the box is axial: what flux/ takes
    /// Hierarchy of traced() for rays; absent if the model neither traces nor asks for positions, Model::speeds or line of sight along a
    /// tilted beam.
    std::shared_ptr<const surface::RayScene> scene;
    std::shared_ptr<const ColumnSight>
        columns;                          ///< of raw, if it asks for line of sight straight upwards alone
    double time = 0.0;                    ///< since the step began
    std::optional<SurfaceFlux> arriving;  ///< on traced(); absent if the model traces no species

    const TriangleMesh& traced() const { return simplified ? *simplified : raw; }
    /// What particles fly past: the sector in place of a round wafer's profile.
    const TriangleMesh& flown() const { return sector ? *sector : traced(); }
};

/// How to trace.
struct TraceRequest {
    std::uint32_t key = 0;  ///< of the random numbers: the time step, counted over the whole run
    bool settle = false;    ///< trace again until the coverages have settled; else one trace does
    std::function<void(double)> progress = {};  ///< called with the finished fraction; may be empty
    double time = 0.0;                          ///< since the step began
    std::function<bool()> stop = interrupted;   ///< asked often, by any thread; true ends the trace
    /// Relative error of the rays alone at which a trace ends, as [flux] accuracy asks; none: as rays or relative_error say.
    std::optional<double> noise = {};
    /// By species, as chosen earlier in the step; empty: choose now.
    std::vector<SpeciesMethod> methods = {};
    flux::Shares shares = {};                         ///< other processes that trace the same surface
    bool errors = true;                               ///< radiosity's standard errors are asked for
    std::function<void(std::string_view)> warn = {};  ///< takes warnings, a line each; may be empty
};

/// More particles leak through the surface than rounding explains.
struct LeakError : NumericsError {
    using NumericsError::NumericsError;
};

}  // namespace sidewall::app
