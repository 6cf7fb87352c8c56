#pragma once
#include <string>
#include <vector>

#include "app/recipe.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// A named figure of the surface; NaN where it does not exist (no opening at that depth).
struct Measure {
    std::string name;  ///< e.g. "depth", "cd_at_0.5"
    double value = 0.0;
};

/// What [metrology] asks for, in the recipe's length unit: `depth` is how far the lowest point of the cut
/// lies below z = 0; `cd` the width of the widest opening at each depth. O(n) in triangles.
std::vector<Measure> measure(const Recipe& recipe, const TriangleMesh& surface);

}  // namespace sidewall::app
