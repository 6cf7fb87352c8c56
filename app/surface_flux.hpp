#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "app/coverage.hpp"
#include "app/models/model.hpp"
#include "app/recipe.hpp"
#include "app/timing.hpp"
#include "flux/tracer.hpp"
#include "levelset/advection.hpp"

namespace sidewall::app {

/// The wafer's surface at one time, and what arrives on it.
struct SurfaceFlux {
    TriangleMesh raw;                        ///< as extracted
    std::optional<TriangleMesh> simplified;  ///< what is traced instead, if anything
    std::vector<std::int32_t> materials;     ///< of the traced mesh's triangles
    std::optional<surface::RayScene> scene;  ///< of the traced mesh; none if the model looks at no surface
    flux::LateralBox box;
    flux::Wedges wedges;
    std::vector<flux::FluxResult> fluxes;          ///< one a species, as counted
    std::vector<std::vector<double>> wedge_flux;   ///< what models see, by tally (tally_names) and wedge
    std::vector<std::vector<double>> wedge_error;  ///< its standard errors; none where nothing was traced
    std::vector<std::vector<double>> coverage;     ///< by Model::coverages and wedge
    int iterations = 0;                            ///< traces it took until the coverages had settled
    double coverage_change = 0.0;                  ///< mean change of a coverage in the last of them

    const TriangleMesh& traced() const { return simplified ? *simplified : raw; }
};

/// Extracts the surface, simplifies it as the recipe says if the model traces species, and traces them;
/// coverages follow from the fluxes, and the next fluxes from them.
/// \param carried    coverages of the surface before, from carried_field; those of the model's that it lacks
///                   begin at 0.
/// \param settle     trace again until the coverages have settled; else one trace does.
/// \param time_step  counts over the whole run; keys the random numbers.
/// \param progress   told the finished fraction of the tracing; may be empty.
/// \throws NumericsError if particles leak through the surface.
SurfaceFlux trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                          const CoverageField& carried, bool settle, std::uint32_t time_step, Timing& timing,
                          const std::function<void(double)>& progress = {});

/// Extracts the surface and gives it the fluxes and coverages of an earlier one, from flux_field, in place of
/// a trace: those of the closest points.
/// \pre the model traces species.
SurfaceFlux carried_surface(const Model& model, const levelset::MaterialStack& stack,
                            const CoverageField& field, Timing& timing);

/// What the next time step needs to know of this one's surface: coverages; how steeply fluxes vary if the
/// recipe lets that bound the simplification; the fluxes themselves if it lets them be used again.
CoverageField carried_field(const Recipe& recipe, const Model& model, const SurfaceFlux& surface);

/// Fluxes and coverages at a point of a traced triangle, barycentric weights \p u and \p v: first all
/// tallies, then all coverages.
/// \pre \p values has room for both.
void interpolate(const SurfaceFlux& surface, std::uint32_t triangle, double u, double v,
                 std::span<double> values);

/// Fluxes to speeds on the grid: the motion of the next time step.
levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const SurfaceFlux& surface, Timing& timing);

/// Whether a straight line from a surface point towards \p direction (unit, upwards) meets no surface; sides
/// are honoured.
bool visible(const SurfaceFlux& surface, const Vec3& point, const Vec3& normal, const Vec3& direction,
             double spacing);

}  // namespace sidewall::app
