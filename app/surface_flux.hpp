#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

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
    std::vector<flux::FluxResult> fluxes;  ///< one a species, as counted
    std::vector<std::vector<double>>
        wedge_flux;  ///< by flux_names and wedge, less its noise: what models see

    const TriangleMesh& traced() const { return simplified ? *simplified : raw; }
};

/// Extracts the surface, simplifies it as the recipe says if the model traces species, and traces them.
/// \param time_step  counts over the whole run; keys the random numbers.
/// \param progress   told the finished fraction of the tracing; may be empty.
/// \throws NumericsError if particles leak through the surface, Interrupted if the user asked to stop.
SurfaceFlux trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                          std::uint32_t time_step, Timing& timing,
                          const std::function<void(double)>& progress = {});

/// Fluxes to speeds on the grid: the motion of the next time step.
levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const SurfaceFlux& surface, Timing& timing);

/// Whether a straight line from a surface point towards \p direction (unit, upwards) meets no surface; sides
/// are honoured.
bool visible(const SurfaceFlux& surface, const Vec3& point, const Vec3& normal, const Vec3& direction,
             double spacing);

}  // namespace sidewall::app
