#pragma once
#include "app/process/arriving/traced_surface.hpp"

namespace sidewall::app {

/// Traces every species and lets the coverages react, in turn, until they have settled: fluxes depend on the
/// sticking that coverages leave, coverages on the fluxes. The random numbers of all turns are the same, so
/// that what is left of a change is not noise. Unless request.settle asks for that, one turn does. A pulsed process instead takes its parts of a pulse one after
/// the other, from a bare surface.
/// Where the methods are to be chosen, they are by the sticking at the beginning, and once more by what the
/// coverages have left when they have settled.
/// \param surface  with its meshes, box and scene.
/// \param arriving  materials and wedges of surface.traced().
/// \param carried  coverages to start from.
/// \returns \p arriving with fluxes, coverages and trace.
/// \throws LeakError, Interrupted as trace_species.
SurfaceFlux settled_fluxes(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                           SurfaceFlux arriving, const SurfaceField& carried, const TraceRequest& request);

/// Sticking that the coverages of \p arriving leave, by species and wedge; empty where they decide nothing.
std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving);

/// Coverages after \p time of the fluxes on a traced surface, one list a name by wedge.
std::vector<std::vector<double>> later_coverages(const Model& model, const TracedSurface& surface,
                                                 double time);

}  // namespace sidewall::app
