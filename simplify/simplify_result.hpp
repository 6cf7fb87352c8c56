#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Result of one pass over the mesh.
struct PassReport {
    double length = 0.0;      ///< only edges shorter than this could collapse
    std::size_t removed = 0;  ///< vertices
};

/// Wall-clock seconds; 0 where not measured.
struct Seconds {
    double features = 0.0;  ///< finding them: filled in by whoever did
    double collapse = 0.0;  ///< from our arrays to our arrays
    double total = 0.0;
};

/// A simplified mesh and how it came about.
struct Result {
    TriangleMesh mesh;
    std::vector<PassReport> passes;  ///< in order; a region schedule with l0 > 0 begins with the whole mesh
    std::vector<std::string> dropped_attributes;  ///< the output carries none but the per-triangle `material`
    Seconds seconds;
};

}  // namespace sidewall::simplify
