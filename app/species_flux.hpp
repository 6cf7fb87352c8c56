#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "app/surface_flux.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

/// More particles leak through the surface than rounding explains.
struct LeakError : NumericsError {
    using NumericsError::NumericsError;
};

/// Traces every species of \p model on \p surface, which has its mesh, scene, materials and wedges: sets its
/// fluxes as counted, and those that models see, less their noise and averaged as the recipe says.
/// \param sticking   as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param time_step  keys the random numbers.
/// \throws LeakError if more particles leak than rounding explains, Interrupted if the user asked to stop.
void trace_species(const Recipe& recipe, const Model& model, std::span<const double> sticking,
                   std::uint32_t time_step, const std::function<void(double)>& progress,
                   SurfaceFlux& surface);

}  // namespace sidewall::app
