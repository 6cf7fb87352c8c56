#pragma once
#include <cmath>
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

/// Extent of a profile along its horizontal axis and in z; without lines left > right and floor > crest.
struct ProfileSpan {
    double left = kInfinity, right = -kInfinity, floor = kInfinity, crest = -kInfinity;
    std::vector<double> from_left, from_right;  ///< z of the lines that begin at either end
};

/// A profile: the lines in which a vertical plane cuts a surface or an interface.
struct Profile {
    std::vector<surface::Polyline> lines;
    Vec3 along;                         // horizontal axis in the plane, unit length
    std::vector<double> mirrors;        // places of the reflective sides on the axis
    std::vector<double> shifts;         // along the axis, to the copies beyond periodic sides
    double middle = 0.0;                // of the domain on the axis; a round wafer's centre
    std::optional<ProfileSpan> span{};  // span_of_profile(), once it is known

    template <class Use>
    void each_segment(Use&& use) const {
        for (const auto& line : lines) {
            for (std::size_t k = 1; k < line.points.size(); ++k) use(line.points[k - 1], line.points[k]);
            if (line.closed && !line.points.empty()) use(line.points.back(), line.points.front());
        }
    }
};

/// The extent of a profile. O(n) in segments if profile.span does not hold it.
ProfileSpan span_of_profile(const Profile& profile);

/// The profile of a mesh of the wafer.
Profile profile_of(const TriangleMesh& mesh, const surface::Plane& plane, const levelset::Domain& domain);

/// Disjoint intervals of a line, ascending; the first may begin at minus infinity, the last end at infinity.
using Stretches = std::vector<std::pair<double, double>>;

/// Intervals of the horizontal line at height \p z in material, mirrored and periodic copies included.
Stretches solid_at(const Profile& profile, double z);

/// Intervals in z of the vertical line at place \p along of the profile in material.
Stretches solid_below(const Profile& profile, double along);

/// The set difference \p a minus \p b.
Stretches without(const Stretches& a, const Stretches& b);

/// The openings at height \p z: intervals between two of material.
Stretches openings(const Profile& profile, double z);

/// The widest opening at height \p z; NaN, NaN if there is none. Of equally wide ones, such as mirrored
/// copies, the one nearest to the domain's middle.
std::pair<double, double> widest_opening(const Profile& profile, double z);

/// Width of the widest opening at height \p z; NaN if there is none.
double opening(const Profile& profile, double z);

/// The opening at height \p z that overlaps most with \p other; NaN, NaN if none does.
std::pair<double, double> opening_over(const Profile& profile, double z,
                                       const std::pair<double, double>& other);

/// Number of heights at which walls are measured: four a cell, as many if rounding makes them a little higher.
inline int wall_samples(double height, double spacing) {
    return static_cast<int>(std::ceil(4.0 * height / spacing - 1e-6));
}

/// Figures of the film between two profiles of a wafer; kNone where one does not exist.
struct Film {
    double top = kNone, side = kNone,
           bottom = kNone;  ///< thickness beside the opening, on its wall halfway down, on its floor
    double depth = kNone;   ///< of the structure that it covers
    bool filled =
        false;  ///< the film's floor is over a cell higher than halfway down, or there is no opening

    /// Step coverage: \p thickness over that of the top; NaN without a film, if it fills the opening, or if
    /// what it covers is at most two grid spacings deep.
    double coverage(double thickness, double spacing) const;
};

/// Measures the film between \p surface and the profile \p below it. The top is measured in the middle of the
/// wider material beside the opening, or at the left end if there is none; the floor midway between its walls,
/// copies beyond the sides included; the side halfway down, but two cells above the film's floor, unless that
/// is over a cell higher than halfway. If \p below is flat within 0.02 grid spacings, the bottom is measured in
/// the middle of the profile, without a side. O(n).
Film film_between(const Profile& surface, const Profile& below, double spacing);

/// Depth below z = 0 of the upper end of a seam, where the films on both walls of the widest opening in
/// \p below have met: the lowest point of the open surface there. kNone unless that is a notch, with slopes
/// of at least 0.1, higher above the floor than half the width: film from the floor alone leaves no seam.
/// kNone, too, if the opening is less than a cell wide there, so that it may be bare, or \p below is flat.
/// \param surface  profile of the open surface. O(n) in segments.
double seam_depth(const Profile& surface, const Profile& below, double spacing);

}  // namespace sidewall::app
