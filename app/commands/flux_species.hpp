#pragma once
#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "flux/species.hpp"
#include "surface/error.hpp"
#include "surface/triangle_mesh.hpp"

// What `sidewall flux` sends: from its options and the mesh's materials.
namespace sidewall::app {

/// \throws RecipeError naming \p where unless \p text is a number.
template <typename Number>
Number parse_number(const std::string& text, const std::string& where) {
    Number value{};
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc{} || end != text.data() + text.size())
        throw RecipeError(fmt::format("{}: \"{}\" is not a number", where, text));
    return value;
}

/// The distinct material ids of a mesh, ascending, and each triangle's place among them: ids need not be small.
struct FluxMaterials {
    std::vector<std::int32_t> ids, of_triangle;
};

/// One material of id 0 where the mesh has no attribute `material`.
/// \throws FileError naming \p path if it has one that is not an integer a triangle.
FluxMaterials read_materials(const TriangleMesh& mesh, const std::string& path);

struct FluxSource {
    std::string sticking = "1";  ///< one probability, or ID=s,ID=s
    double exponent = 1.0;
    std::optional<double> mean_free_path;
};

/// \throws RecipeError naming the option that is wrong.
flux::Species species_of(const FluxSource& source, const TriangleMesh& mesh, const FluxMaterials& materials,
                         const std::string& path);

}  // namespace sidewall::app
