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

// The types that the phases of a time step pass on: the surface, the request to trace it, and the fluxes.
namespace sidewall::app {

class ColumnSight;  // arriving/line_of_sight.hpp

/// The method by which the flux of a species is found.
struct SpeciesMethod {
    std::string species;     ///< its name
    bool radiosity = false;  ///< otherwise Monte Carlo
    std::string reason;      ///< for the choice, in messages; may be empty
    double target =
        0.0;            ///< relative error that radiosity is to reach, equal to that of [flux] rays; 0: none
    double rays = 0.0;  ///< rays an unknown to begin radiosity with; 0: as few as an error estimate needs
};

/// What a trace yields besides the fluxes that models see.
struct TraceReport {
    /// Raw results by Model::species. For species solved by radiosity, emitted, segments and leaked count the
    /// rays gathered for all of them as one pass; where particles ended is not known.
    std::vector<flux::FluxResult> species;
    std::vector<SpeciesMethod> methods;      ///< by Model::species
    std::vector<std::vector<double>> error;  ///< standard errors of SurfaceFlux::flux, by tally and wedge
    int traces = 0;                          ///< number of traces until the coverages had settled
    double coverage_change = 0.0;            ///< mean change of a coverage in the last trace
};

/// The direct flux from a species' source, a function of the surface's normal, and the rest of its flux.
struct DirectPart {
    std::shared_ptr<const flux::DirectFlux> source;
    std::size_t tally = 0;                  ///< index of the species' first tally
    std::vector<std::vector<double>> open;  ///< by beam, tally and wedge (flux::open_shares)
    std::vector<std::vector<double>> rest;  ///< flux of later hits, by DirectFlux::tallies and wedge
};

/// Fluxes and coverages on a surface. Every list is complete.
struct SurfaceFlux {
    std::vector<std::int32_t> materials;        ///< by triangle of the mesh
    flux::Wedges wedges;                        ///< of the mesh: split at creases and material edges
    std::vector<std::vector<double>> flux;      ///< as models see it, by tally (flux_names) and wedge
    std::vector<DirectPart> direct;             ///< direct parts of flux
    std::vector<std::vector<double>> coverage;  ///< by Model::coverages and wedge
    std::optional<TraceReport> trace;           ///< absent if all is carried over from an earlier surface
};

/// The wafer's surface at one time, the mesh traced in its place, and the fluxes on it.
struct TracedSurface {
    TriangleMesh raw;                            ///< as extracted
    std::vector<levelset::SurfacePiece> pieces;  ///< of raw
    std::optional<TriangleMesh> simplified;      ///< the mesh to trace, if it is another one
    flux::LateralBox box;                        ///< sides of the domain
    std::optional<TriangleMesh> sector;          ///< of traced(), if the box is axial: the mesh for flux/
    /// Hierarchy of traced() for rays; absent if the model neither traces nor needs positions, Model::speeds
    /// or line of sight along a tilted beam.
    std::shared_ptr<const surface::RayScene> scene;
    std::shared_ptr<const ColumnSight> columns;  ///< of raw, if the model needs only vertical line of sight
    double time = 0.0;                           ///< since the step began
    std::optional<SurfaceFlux> arriving;         ///< on traced(); absent if the model traces no species

    const TriangleMesh& traced() const { return simplified ? *simplified : raw; }
    /// The mesh that particles meet: for an axial wafer's profile the sector.
    const TriangleMesh& flight_mesh() const { return sector ? *sector : traced(); }
};

/// Options of a trace.
struct TraceRequest {
    std::uint32_t key = 0;  ///< of the random numbers: the time step, counted over the run
    bool settle = false;    ///< trace until the coverages have settled, not once
    std::function<void(double)> progress = {};  ///< called with the finished fraction; may be empty
    double time = 0.0;                          ///< since the step began
    std::function<bool()> stop = interrupted;   ///< polled often, by any thread; true ends the trace
    /// Relative statistical error at which a trace ends, from [flux] accuracy; none: by rays or
    /// relative_error.
    std::optional<double> noise = {};
    /// By species, as chosen earlier in the step; empty: chosen by this trace.
    std::vector<SpeciesMethod> methods = {};
    flux::Shares shares = {};                         ///< other processes that trace the same surface
    bool errors = true;                               ///< whether radiosity computes standard errors
    std::function<void(std::string_view)> warn = {};  ///< takes warnings, a line each; may be empty
};

/// Thrown if more particles leak through the surface than rounding explains.
struct LeakError : NumericsError {
    using NumericsError::NumericsError;
};

}  // namespace sidewall::app
