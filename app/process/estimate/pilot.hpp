#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// The purpose and the surface of a pilot trace.
struct PilotRequest {
    const Recipe& recipe;    ///< its traces are to be estimated
    const Recipe& measured;  ///< the same on the grid of \p stack, which may be coarser
    const levelset::MaterialStack& stack;
    double cells = 1.0;                ///< cells of the recipe's grid per cell of the stack's
    double effort = 0.0;               ///< seconds to spend tracing
    std::optional<double> noise = {};  ///< as TraceRequest::noise
};

/// The fluxes of a step's first time step, and the cost of the step's traces, estimated from few rays.
struct Pilot {
    TracedSurface surface;
    double reducing = 0.0;               ///< seconds from the grid to the traced mesh and its hierarchy
    double seconds = 0.0;                ///< of a trace with all its rays
    double rays = 0.0;                   ///< of a trace, all species
    int at_start = 0, later = 0;         ///< traces in the step's first time step, and in each other one
    double error = 0.0;                  ///< relative error of the worst species
    double exchange_bytes = 0.0;         ///< memory of radiosity's rays
    std::vector<SpeciesMethod> methods;  ///< by species
    std::vector<std::string> short_of;  ///< messages about relative errors that the allowed rays do not reach
};

/// Traces a few rays, until the coverages have settled; then as many as the effort allows.
/// \throws as trace_surface.
Pilot trace_pilot(const PilotRequest& request, const Model& model);

}  // namespace sidewall::app
