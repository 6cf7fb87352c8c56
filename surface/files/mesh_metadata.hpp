#pragma once
#include <string>
#include <utility>
#include <vector>

namespace sidewall::surface {

/// What a file says about the whole mesh: units, time, model. VTP keeps it as FieldData, PLY as comments (not
/// read back).
struct MeshMetadata {
    /// Texts by name, e.g. {"length_unit", "um"}. A list, such as the names of materials, is one text with
    /// zero bytes between its items; VTP stores it as an array of strings, so items may hold all other bytes.
    std::vector<std::pair<std::string, std::string>> texts;
    std::vector<std::pair<std::string, double>> numbers;  ///< e.g. {"time", 5.0}
    /// What the reader left out, in words, e.g. "12 normals". Writers ignore it.
    std::vector<std::string> dropped;
};

}  // namespace sidewall::surface
