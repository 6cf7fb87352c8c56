#pragma once
#include "app/results/cut_profile.hpp"

namespace sidewall::app {

/// The film between two profiles of a wafer; kNone where a figure does not exist.
struct Film {
    double top = kNone, side = kNone,
           bottom = kNone;  ///< thickness beside, on the wall halfway down, on the floor
    double depth = kNone;   ///< of what it covers
    bool filled = false;    ///< nothing is open halfway down

    /// Step coverage: thickness at a place over that beside; NaN without a film, or where it covers no walls.
    double coverage(double thickness, double spacing) const;
};

/// Beside is where the profile begins or, where what the film covers lies over a mirrored or periodic side, in the middle
/// of the material next to it. Where that is flat within 0.02 of the grid spacing \p spacing, the film's bottom is in
/// the middle of the profile, and it has no side. O(n) in segments.
Film film_between(const Profile& surface, const Profile& below, double spacing);

}  // namespace sidewall::app
