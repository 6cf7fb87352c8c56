#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The method for each species of \p model by [flux] method; auto takes what flux::choose_method estimates to
/// cost less on \p surface. Species are decided on together: radiosity gathers its rays once for all, and a
/// Monte Carlo pass costs as much as its most expensive species.
/// \param arriving  with materials and wedges of the traced mesh.
/// \param sticking  as flux::TraceOptions::sticking_by_wedge.
/// \param request   its key, noise, stop and shares are used.
/// \returns the same on every machine and any number of threads.
std::vector<SpeciesMethod> choose_methods(const Recipe& recipe, const Model& model,
                                          const TracedSurface& surface, const SurfaceFlux& arriving,
                                          std::span<const double> sticking, const TraceRequest& request);

/// The methods in words, e.g. "etchant by radiosity (reason); ion by monte-carlo (reason)".
std::string describe(const std::vector<SpeciesMethod>& methods);

/// Whether \p methods belong to the model's species, by name and order.
bool are_of(const Model& model, const std::vector<SpeciesMethod>& methods);

/// The name of the method in recipes.
const char* method_name(const SpeciesMethod& method);

}  // namespace sidewall::app
