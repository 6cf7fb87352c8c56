#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

// Values on the surface that one time step leaves for the next: coverages, fluxes and flux gradients.
namespace sidewall::app {

/// Named values by triangle corner of a surface: linear on triangles, with jumps at creases and material
/// edges.
struct SurfaceField {
    std::vector<std::string> names;
    std::vector<std::vector<double>> corner;         ///< one list a name: corner k of triangle t at 3 t + k
    std::shared_ptr<const surface::RayScene> scene;  ///< of the surface's mesh; absent if there are no values
};

/// The field of values given by wedge.
/// \param by_wedge  one list a name.
/// \param scene     of \p mesh; built here if it is absent.
SurfaceField surface_field(const TriangleMesh& mesh, const flux::Wedges& wedges,
                           const std::vector<std::string>& names,
                           const std::vector<std::vector<double>>& by_wedge,
                           std::shared_ptr<const surface::RayScene> scene = nullptr);

/// Values at points near the surface, one list for each of \p names: those of the field's closest point; 0
/// for names that it lacks. O(log n) a point, parallel, deterministic.
/// \param box  the domain's sides; the closest point may lie across periodic ones.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       std::span<const Vec3> points, const flux::LateralBox& box);

/// Values on another surface, one list for each of \p names by wedge of \p mesh. Each search starts slightly
/// inside the wedge's fan, so that it finds the right side of a crease.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges,
                                       const flux::LateralBox& box);

/// Values by wedge of \p mesh: carry(), but the unchanged values if it is the field's own mesh. So values on
/// a surface that does not move keep every bit, where repeated searches would make them drift.
std::vector<std::vector<double>> kept_or_carried(const SurfaceField& field,
                                                 const std::vector<std::string>& names,
                                                 const TriangleMesh& mesh, const flux::Wedges& wedges,
                                                 const flux::LateralBox& box);

/// For checkpoints: keeps every bit, as binary blobs, so that the JSON must be stored in a binary form.
Json to_json(const SurfaceField& field);

/// \throws nlohmann exceptions or FileError if it is not what to_json made.
SurfaceField surface_field_from_json(const Json& json);

/// How many time steps reuse the fluxes of the last trace; part of the run's state.
struct FluxReuse {
    std::uint32_t left = 0;   ///< time steps that will still reuse them
    std::uint32_t since = 0;  ///< time steps made with them so far
};

/// Name under which the flux gradient is carried to the next time step, beside the coverages.
inline constexpr const char* kFluxGradient = "flux_gradient";

/// Whether [simplify] bounds edge lengths by the fluxes of the time step before.
bool bounds_by_flux(const SimplifySection& section);

/// Relative gradient of the fluxes along the traced mesh, by wedge, per length: the largest change of any
/// tally along an edge at the wedge, less three standard errors, as a share of its mean there. 0 where only
/// noise changes.
/// \param mesh      the traced mesh.
/// \pre \p arriving was traced there, not carried over.
std::vector<double> flux_gradient(const TriangleMesh& mesh, const SurfaceFlux& arriving);

/// Names under which a model's fluxes and coverages are carried: flux_*, then its coverages.
std::vector<std::string> carried_names(const Model& model);

/// Fluxes and coverages as a field on the traced mesh, named by carried_names.
/// \pre the surface has fluxes.
SurfaceField flux_field(const Model& model, const TracedSurface& surface);

/// Takes fluxes and coverages from the closest points of \p field instead of a trace.
/// \param parts  with materials and wedges of \p mesh.
/// \param box    of the mesh, as in carry().
/// \returns \p parts with fluxes and coverages added.
SurfaceFlux carried_fluxes(const Model& model, const SurfaceField& field, const TriangleMesh& mesh,
                           const flux::LateralBox& box, SurfaceFlux parts);

/// The surface with fluxes extrapolated from those F_before at the closest point one time step earlier: F +
/// share (F - F_before). Share 1/2 gives the middle of a time step as long as the one before (two-step
/// Adams-Bashforth method). Fluxes that changed by more than a third, e.g. at a moving shadow edge, stay
/// unchanged, as do direct fluxes of narrow sources.
/// \param before  fluxes of the time step before.
/// \pre the surface was traced.
TracedSurface with_later_fluxes(const Model& model, const SurfaceField& before, const TracedSurface& surface,
                                double share);

/// The values that the next time step needs: fluxes and coverages, and flux gradients if bounds_by_flux.
/// \param coverage  at the end of this time step, one list a name by wedge.
/// \pre the surface was traced.
SurfaceField field_to_carry(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                            const std::vector<std::vector<double>>& coverage);

/// Relative change of the fluxes since \p field was traced: the mean difference over the surface as a share
/// of the mean flux, less the part that standard errors explain; the largest of all tallies.
/// \pre the surface was traced.
double flux_change(const Model& model, const SurfaceField& field, const TracedSurface& surface);

/// How many more time steps, at most 8, the fluxes stay within \p tolerance if they go on changing by
/// \p change in \p since time steps.
std::uint32_t time_steps_within(double tolerance, double change, std::uint32_t since);

/// Reuse of the present fluxes in later time steps. Carried fluxes: \p reuse counted down. Traced fluxes: as
/// many time steps as their change since the last trace allows.
/// \param tolerance  [flux] reuse.
/// \param before     fluxes of the trace before; null at the start of a step, where their change is unknown.
FluxReuse next_reuse(double tolerance, const Model& model, const FluxReuse& reuse, const SurfaceField* before,
                     const TracedSurface& surface);

}  // namespace sidewall::app
