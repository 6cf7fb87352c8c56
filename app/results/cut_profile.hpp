#pragma once
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/domain.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The value of a figure that does not exist.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The ends of a profile, along it and in z; infinite the wrong way round without one.
struct ProfileSpan {
    double left = kInfinity, right = -kInfinity, floor = kInfinity, crest = -kInfinity;
    std::vector<double> from_left, from_right;  ///< heights of the lines that set out from either end
};

/// A profile: where a vertical plane cuts a surface or an interface.
struct Profile {
    std::vector<surface::Polyline> lines;
    Vec3 along;                         // horizontal axis in the plane
    std::vector<double> mirrors;        // reflective sides, where a half structure's other half begins
    std::vector<double> shifts;         // along the profile to its repetitions beyond periodic sides
    double middle = 0.0;                // of the wafer, along the profile
    std::optional<ProfileSpan> span{};  // of the lines, once it is known

    template <class Use>
    void each_segment(Use&& use) const {
        for (const auto& line : lines) {
            for (std::size_t k = 1; k < line.points.size(); ++k) use(line.points[k - 1], line.points[k]);
            if (line.closed && !line.points.empty()) use(line.points.back(), line.points.front());
        }
    }
};

ProfileSpan span_of_profile(const Profile& profile);

Profile profile_of(const TriangleMesh& mesh, const surface::Plane& plane, const levelset::Domain& domain);

/// Stretches of a line, ascending and apart; the first may begin at minus infinity, the last end at infinity.
using Stretches = std::vector<std::pair<double, double>>;

/// Stretches of the horizontal line at a height that lie in material, mirrored and periodic copies included.
Stretches solid_at(const Profile& profile, double z);

/// Stretches in z of the vertical line at a place along the profile that lie in material.
Stretches solid_below(const Profile& profile, double along);

/// The difference \p a minus \p b.
Stretches without(const Stretches& a, const Stretches& b);

/// The openings at a height, between two stretches of material.
Stretches openings(const Profile& profile, double z);

/// The widest opening at a height; of equally wide ones, such as a mirrored copy, the one nearest to the domain's middle;
/// NaN, NaN if there is none.
std::pair<double, double> widest_opening(const Profile& profile, double z);

/// Width of the widest opening; NaN if there is none.
double opening(const Profile& profile, double z);

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
