#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::levelset {

/// A lithography model: the area of a layout's polygons, blurred by Gaussians, is cut at a threshold.
struct Blur {
    std::vector<double> sigmas;   ///< standard deviations, world units, each above 0
    std::vector<double> weights;  ///< as many, each above 0, of any sum; empty: equal weights
    double threshold = 0.5;       ///< relative to the value inside a large polygon, in (0, 1)
};

/// Contours of the resist that remains under a layout after exposure.
struct ResistContours {
    std::vector<Polygon> outlines;   ///< the resist lies left of all of them; they neither cross nor touch
    std::vector<std::size_t> lost;   ///< polygons that reach into the domain but leave no resist
    double least = 0.0, most = 0.0;  ///< values of the blurred area within the domain
};

/// Blurs the union of \p polygons within the domain and cuts it at the threshold. Beyond the domain the
/// layout is mirrored or repeated, as the wafer is.
///
/// Pixels are a fifth of the smallest sigma wide, but at least a fifth of the grid spacing. The covered area
/// of a pixel is exact for edges along the axes, and of second order in an eighth of a pixel for others; the
/// Gaussians' weights are exact. Wider Gaussians act on means over pixels of a fifth of their own sigma;
/// results are interpolated, as contours are. The contour of a straight edge errs by at most 0.01 sigma, or a
/// twentieth of a grid spacing where the spacing exceeds sigma.
///
/// \returns outlines that extend 16 grid spacings beyond the domain, at most half its extent.
/// \param stop  polled between Gaussians and polygons; true ends the work.
/// \throws GeometryError for over 5e7 pixels, or 3e10 multiplications, which take some seconds; Interrupted
///         if \p stop said so.
ResistContours resist_contours(const std::vector<Polygon>& polygons, const Blur& blur, const Domain& domain,
                               const std::function<bool()>& stop = {});

}  // namespace sidewall::levelset
