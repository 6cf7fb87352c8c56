#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// What a pilot trace is for, and on what.
struct PilotRequest {
    const Recipe& recipe;    ///< whose traces are to be estimated
    const Recipe& measured;  ///< the same on the grid of \p stack, which may be coarser
    const levelset::MaterialStack& stack;
    double cells = 1.0;                ///< of the recipe's grid for one of the stack's
    double effort = 0.0;               ///< seconds to spend tracing
    std::optional<double> noise = {};  ///< as TraceRequest's
};

/// The fluxes of a step's first time step, and what its traces will take, estimated from few rays.
struct Pilot {
    TracedSurface surface;
    double reducing = 0.0;               ///< seconds from the grid to the mesh that is traced
    double seconds = 0.0;                ///< of a trace with all rays
    double rays = 0.0;                   ///< all, of all species
    int at_start = 0, later = 0;         ///< traces of the step's first time step and of the others
    double error = 0.0;                  ///< relative, of the worst species
    double exchange_bytes = 0.0;         ///< that the rays of radiosity take
    std::vector<SpeciesMethod> methods;  ///< by species
    std::vector<std::string> short_of;   ///< relative errors that the rays allowed do not reach, in words
};

/// Traces few rays, which also lets the coverages settle, and then as many as the effort allows.
/// \throws as trace_surface.
Pilot trace_pilot(const PilotRequest& request, const Model& model);

}  // namespace sidewall::app
