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

/// Beside is where the profile begins or, where what the film covers lies over a mirrored or periodic side or ends within a
/// cell of it, in the middle of the material next to it. The floor is measured midway between its walls, with what lies
/// beyond the sides. Where that is flat within 0.02 of the grid spacing \p spacing, the film's bottom is in
/// the middle of the profile, and it has no side. O(n) in segments.
Film film_between(const Profile& surface, const Profile& below, double spacing);

/// Depth below z = 0 of the upper end of the seam where film from both walls of the widest opening below it has met: the
/// lowest point of the open surface there. kNone unless that is a notch, whose sides rise by a tenth or more, and lies higher over
/// the floor than half the width: a film that has come from the floor alone leaves no seam.
/// \param surface  of what is open. O(n) in segments.
double seam_depth(const Profile& surface, const Profile& below);

}  // namespace sidewall::app
