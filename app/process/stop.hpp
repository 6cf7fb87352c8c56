#pragma once
#include <limits>

#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The stop condition that the surface is nearest to.
struct StopDistance {
    double left =
        std::numeric_limits<double>::infinity();  ///< to move; 0 if it holds, infinite if there is none
    const char* key = "";                         ///< as recipes call it
};

/// How far the surface may still move before one of the step's stop conditions holds. A condition counts as reached a thousandth of a grid spacing early.
///
/// stop_depth: the lowest point's depth below z = 0. stop_material: bare somewhere; what covers it is not
/// looked at, since a time step ends at an interface by itself. stop_thickness: of the uppermost layer where
/// it is thickest. stop: a figure that is a length changes by no more than twice the way of the front, a depth by as
/// much, a volume by the front's area times it; for how much an angle or a ratio changes there is no bound, and nothing
/// is left of the way only when they are there.
/// \param surface  as extracted from the stack.
/// \note O(n log n) for stop_thickness, for stop as the figure takes, else O(n).
StopDistance distance_to_stop(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack,
                              const TriangleMesh& surface);

/// Says on standard error if a stop condition holds before the step begins, or can never be met.
/// \param number   the step's, counted from 1.
/// \param to_stop  from distance_to_stop.
void note_stop(const Step& step, std::size_t number, double to_stop);

/// Says on standard error if a step has ended by its duration while there was no figure of its `stop`, which could not
/// stop it.
void note_missing_figure(const Recipe& recipe, const Step& step, std::size_t number,
                         const levelset::MaterialStack& stack);

}  // namespace sidewall::app
