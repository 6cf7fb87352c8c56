#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// How each species of \p model is to be traced, as [flux] method says; auto takes what flux::choose_method
/// estimates to cost less on \p surface. Rays are gathered once for all species that radiosity takes, and a
/// Monte Carlo pass costs what its most expensive species does, so all are decided on together.
/// \param arriving  has the materials and wedges of the traced mesh.
/// \param sticking  as flux::TraceOptions::sticking_by_wedge.
/// \param request   its key and progress.
/// \returns the same on every machine, with any number of threads.
std::vector<SpeciesMethod> choose_methods(const Recipe& recipe, const Model& model,
                                          const TracedSurface& surface, const SurfaceFlux& arriving,
                                          std::span<const double> sticking, const TraceRequest& request);

/// "etchant by radiosity (why); ion by monte-carlo (why)".
std::string describe(const std::vector<SpeciesMethod>& methods);

/// Whether \p methods are of the model's species.
bool are_of(const Model& model, const std::vector<SpeciesMethod>& methods);

/// What recipes call the method.
const char* method_name(const SpeciesMethod& method);

}  // namespace sidewall::app
