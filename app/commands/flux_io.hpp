#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

// Input and output of `sidewall flux`: the species from options and materials, results as CSV, VTP or JSON.
namespace sidewall::app {

/// Parses \p text, all of which must be one number.
/// \throws RecipeError naming \p where if it is none.
template <typename Number>
Number parse_number(const std::string& text, const std::string& where) {
    Number value{};
    if (!surface::read_number(text, value)) throw RecipeError("{}: \"{}\" is not a number", where, text);
    return value;
}

/// Materials of a mesh: the distinct ids, ascending, and each triangle's index among them.
struct FluxMaterials {
    std::vector<std::int32_t> ids, of_triangle;
};

/// Reads the triangle attribute `material`. Without it there is one material, of id 0; of_triangle is empty.
/// \throws FileError naming \p path if the attribute is not an integer a triangle.
FluxMaterials flux_materials(const TriangleMesh& mesh, const std::string& path);

/// Options of source and sticking on the command line.
struct FluxSource {
    std::string sticking = "1";  ///< one probability, or ID=s,ID=s
    double exponent = 1.0;
    std::optional<double> mean_free_path;
};

/// The species to trace.
/// \throws RecipeError naming the option that is wrong.
flux::Species species_of(const FluxSource& source, const TriangleMesh& mesh, const FluxMaterials& materials,
                         const std::string& path);

/// Writes a flux on \p mesh as .csv, a row a triangle, or as .vtp with flux, flux_error and area of each
/// triangle, flux and flux_error of each vertex and the mesh's \p metadata.
/// \throws IoError if \p path cannot be written.
void write_flux(const std::string& path, TriangleMesh mesh, const surface::MeshMetadata& metadata,
                const flux::TallyFlux& result);

/// The part of the summary on the calculation: method, rays, times, balance of particles and errors.
Json found_json(const flux::FoundFlux& found);

/// Prints a summary as text.
void print_flux_summary(const Json& json);

}  // namespace sidewall::app
