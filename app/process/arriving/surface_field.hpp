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

// Values on the surface that one time step leaves for the next: coverages, fluxes, how steeply fluxes vary.
namespace sidewall::app {

/// Named values on a surface, by triangle corner: linear over triangles, with jumps at creases and material
/// edges.
struct SurfaceField {
    std::vector<std::string> names;
    std::vector<std::vector<double>> corner;         ///< one list a name: corner k of triangle t at 3 t + k
    std::shared_ptr<const surface::RayScene> scene;  ///< of the surface's mesh; absent if there are no values
};

/// The field of values that are known by wedge.
/// \param scene  of \p mesh; built here if it is absent.
/// \param by_wedge  one list a name.
SurfaceField surface_field(const TriangleMesh& mesh, const flux::Wedges& wedges,
                           const std::vector<std::string>& names,
                           const std::vector<std::vector<double>>& by_wedge,
                           std::shared_ptr<const surface::RayScene> scene = nullptr);

/// Values at points near the surface, one list of \p names: those of the closest point of the field; 0 for
/// names it does not have. O(log n) a point, parallel, deterministic.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       std::span<const Vec3> points);

/// Values on another surface, one list of \p names by wedge of \p mesh. Each search starts a little inside the
/// wedge's own fan, so that it finds values of its own side of a crease.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges);

/// Values on another surface as by carry; on the field's own one, the values themselves. A surface that stands
/// still so keeps them to the last bit, which repeated searches would let creep.
std::vector<std::vector<double>> kept_or_carried(const SurfaceField& field,
                                                 const std::vector<std::string>& names,
                                                 const TriangleMesh& mesh, const flux::Wedges& wedges);

/// For checkpoints, every bit kept: numbers as binary blobs, so only for JSON that is stored in a binary
/// form.
Json to_json(const SurfaceField& field);

/// \throws nlohmann exceptions or FileError if it is not what to_json made.
SurfaceField surface_field_from_json(const Json& json);

/// For how many time steps the fluxes of the last trace serve; part of the run's state.
struct FluxReuse {
    std::uint32_t left = 0;   ///< time steps still to be made with them
    std::uint32_t since = 0;  ///< time steps made with them
};

/// The name under which a time step's flux gradient is carried on to the next one, among the coverages.
inline constexpr const char* kFluxGradient = "flux_gradient";

/// Whether [simplify] lets the fluxes of the time step before bound the lengths of edges.
bool bounds_by_flux(const SimplifySection& section);

/// How steeply the fluxes vary along the traced mesh, by wedge: the largest change of any tally along an edge
/// at the wedge, less three standard errors, as a share of its mean there, per length. 0 where nothing but
/// noise changes.
/// \param mesh      traced.
/// \pre \p arriving was traced there, not carried over.
std::vector<double> flux_gradient(const TriangleMesh& mesh, const SurfaceFlux& arriving);

/// Names under which fluxes and coverages of a model are carried on: flux_*, then its coverages.
std::vector<std::string> carried_names(const Model& model);

/// Fluxes and coverages as a field on the traced mesh, by carried_names.
/// \pre the surface has fluxes.
SurfaceField flux_field(const Model& model, const TracedSurface& surface);

/// Fluxes and coverages of the closest points of \p field, in place of a trace.
/// \param parts  materials and wedges of \p mesh.
/// \returns \p parts with fluxes and coverages.
SurfaceFlux carried_fluxes(const Model& model, const SurfaceField& field, const TriangleMesh& mesh,
                           SurfaceFlux parts);

/// The surface with the fluxes of a later time, by what they were a time step before at the closest point: F + share (F -
/// F_before), share 1/2 for the middle of a time step as long as the one before (the two-step method of Adams and Bashforth).
/// Fluxes that changed by more than a third, as where a shadow's edge has passed, stay as they are, and so does what comes
/// straight from a narrow source.
/// \param before  fluxes of the time step before.
/// \pre the surface was traced.
TracedSurface with_later_fluxes(const Model& model, const SurfaceField& before, const TracedSurface& surface,
                                double share);

/// What the next time step needs to know of this one's surface: fluxes and coverages; how steeply fluxes vary if the
/// recipe lets that bound the simplification.
/// \param coverage  at the end of this time step, one list a name by wedge.
/// \pre the surface was traced.
SurfaceField field_to_carry(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                            const std::vector<std::vector<double>>& coverage);

/// How much the fluxes have changed since \p field was traced: the mean difference over the surface as a
/// share of the mean flux, the most of all tallies, with the part that the standard errors explain taken out.
/// \pre the surface was traced.
double flux_change(const Model& model, const SurfaceField& field, const TracedSurface& surface);

/// How many time steps more the fluxes will stay within \p tolerance, if they go on changing by \p change
/// every \p since time steps; no more than 8.
std::uint32_t time_steps_within(double tolerance, double change, std::uint32_t since);

/// For how many time steps more the fluxes just used serve: \p reuse counted down if they were carried over; after a trace
/// as many time steps as their change since the last one allows.
/// \param tolerance  [flux] reuse.
/// \param before     fluxes of the trace before; null at the start of a step of the recipe, where nothing
///                   is known yet of how fast they change.
FluxReuse next_reuse(double tolerance, const Model& model, const FluxReuse& reuse, const SurfaceField* before,
                     const TracedSurface& surface);

}  // namespace sidewall::app
