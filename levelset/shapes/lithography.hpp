#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::levelset {

/// A model of lithography: the area under a layout's polygons is blurred by a sum of Gaussians and cut at a threshold.
struct Blur {
    std::vector<double> sigmas;   ///< standard deviations, world units, each above 0
    std::vector<double> weights;  ///< as many, each above 0; their sum counts as 1. None: equal ones
    double threshold = 0.5;       ///< share of the value under a large polygon, in (0, 1)
};

/// Contours of the resist that a layout leaves after exposure.
struct ResistContours {
    std::vector<Polygon> outlines;   ///< the resist lies left of all of them; they neither cross nor touch
    std::vector<std::size_t> lost;   ///< polygons that reach into the domain and leave no resist
    double least = 0.0, most = 0.0;  ///< values of the blurred area within the domain
};

/// Blurs the union of \p polygons within the domain and cuts it at the threshold. Beyond the domain the layout goes on as
/// the wafer does, mirrored or repeated.
///
/// The area is exact on pixels of a fifth of the least sigma, but at least of a fifth of the grid spacing (exact for
/// edges along the axes, of second order in an eighth of a pixel for others); so are the Gaussians' weights. Wider ones
/// take the means over pixels of a fifth of their own sigma and are interpolated, as contours are. The contour of a straight
/// edge is within 0.01 sigma of its place, or a twentieth of a grid spacing where that is more than a sigma.
///
/// \returns outlines that go on for 16 grid spacings beyond the domain, at most half its extent.
/// \param stop  polled now and then.
/// \throws GeometryError for over 5e7 pixels, or 3e10 multiplications, which take some seconds; Interrupted if \p stop
///         said so.
ResistContours resist_contours(const std::vector<Polygon>& polygons, const Blur& blur, const Domain& domain,
                               const std::function<bool()>& stop = {});

}  // namespace sidewall::levelset
