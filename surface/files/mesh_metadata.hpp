#pragma once
#include <string>
#include <utility>
#include <vector>

namespace sidewall::surface {

/// What a file says about the whole mesh: units, time, model. VTP keeps it as FieldData, PLY as comments (not
/// read back).
struct MeshMetadata {
    std::vector<std::pair<std::string, std::string>> texts;  ///< e.g. {"length_unit", "um"}
    std::vector<std::pair<std::string, double>> numbers;     ///< e.g. {"time", 5.0}
    /// What the reader had to leave out, in words, e.g. "12 normals". Writers ignore it.
    std::vector<std::string> dropped;
};

}  // namespace sidewall::surface
