#include "app/commands/flux_io.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {
namespace {

double parse_probability(const std::string& text, const std::string& where) {
    const double value = parse_number<double>(text, where);
    if (!(value >= 0.0 && value <= 1.0)) throw RecipeError("{}: must be in [0, 1]", where);
    return value;
}

// Parses one sticking probability for all, or ID=s,ID=s; returns one for each of \p ids in their order.
std::vector<double> parse_sticking(const std::string& text, const std::vector<std::int32_t>& ids,
                                   const std::string& path) {
    if (text.find('=') == std::string::npos) return {parse_probability(text, "--sticking " + text)};
    std::vector<double> sticking(ids.size(), -1.0);
    for (const std::string& part : split(text, ',')) {
        const std::string where = "--sticking " + part;
        const auto equals = part.find('=');
        if (equals == std::string::npos)
            throw RecipeError(where + ": write ID=s, as in --sticking 0=0.1,1=0.5");
        const auto id = parse_number<std::int32_t>(part.substr(0, equals), where);
        const double value = parse_probability(part.substr(equals + 1), where);
        const auto found = std::lower_bound(ids.begin(), ids.end(), id);
        if (found == ids.end() || *found != id)
            throw RecipeError("{}: {} has no material {}; it has {}", where, path, id, fmt::join(ids, ", "));
        double& slot = sticking[static_cast<std::size_t>(found - ids.begin())];
        if (slot >= 0.0) throw RecipeError("{}: material {} is given twice", where, id);
        slot = value;
    }
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (sticking[i] < 0.0)
            throw RecipeError("--sticking {}: material {} of {} is missing", text, ids[i], path);
    return sticking;
}

std::string csv_text(const TriangleMesh& mesh, const flux::TallyFlux& result) {
    std::string text = "triangle,x,y,z,area,flux,flux_error\n";
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 c = triangle_centroid(mesh, t);
        fmt::format_to(std::back_inserter(text), "{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t, c.x(),
                       c.y(), c.z(), triangle_area(mesh, t), result.triangle.flux[t],
                       result.triangle.error[t]);
    }
    return text;
}

void set_attribute(std::vector<Attribute>& attributes, const std::string& name, std::vector<double> values) {
    std::erase_if(attributes, [&](const Attribute& a) { return a.name == name; });
    attributes.push_back({name, 1, Scalar::float64, std::move(values)});
}

}  // namespace

FluxMaterials flux_materials(const TriangleMesh& mesh, const std::string& path) {
    const Attribute* attribute = mesh.triangle_attribute("material");
    if (!attribute) return {{0}, {}};
    if (attribute->components != 1 || attribute->values.size() != mesh.triangles.size())
        throw FileError("{}: attribute material must be one integer a triangle", path);
    FluxMaterials materials;
    for (std::size_t t = 0; t < attribute->values.size(); ++t) {
        const double value = attribute->values[t];
        if (!(std::abs(value) <= 2147483647.0) || value != std::floor(value))
            throw FileError("{}: triangle {} has material {}: must be an integer", path, t, value);
        materials.of_triangle.push_back(static_cast<std::int32_t>(value));
    }
    materials.ids = materials.of_triangle;
    std::sort(materials.ids.begin(), materials.ids.end());
    materials.ids.erase(std::unique(materials.ids.begin(), materials.ids.end()), materials.ids.end());
    for (std::int32_t& id : materials.of_triangle)
        id = static_cast<std::int32_t>(std::lower_bound(materials.ids.begin(), materials.ids.end(), id) -
                                       materials.ids.begin());
    return materials;
}

flux::Species species_of(const FluxSource& source, const TriangleMesh& mesh, const FluxMaterials& materials,
                         const std::string& path) {
    flux::Species species{"flux", source.exponent, parse_sticking(source.sticking, materials.ids, path)};
    if (!source.mean_free_path) return species;
    // Diffusion over n mean free paths takes about n^2 collisions.
    constexpr double kLeast = 1e-3;  // least mean free path over the diagonal of the bounding box
    const double least = kLeast * bounding_box(mesh).size().norm();
    if (!(*source.mean_free_path >= least))
        throw RecipeError(
            "--mean-free-path {:g}: particles would collide too often to be followed: give a length of "
            "{:.3g} or more, a thousandth of the surface's size",
            *source.mean_free_path, least);
    species.mean_free_path = *source.mean_free_path;
    return species;
}

void write_flux(const std::string& path, TriangleMesh mesh, const surface::MeshMetadata& metadata,
                const flux::TallyFlux& result) {
    if (fs::path(path).extension() == ".csv") return write_file(path, csv_text(mesh, result));
    std::vector<double> area(mesh.triangles.size());
    for (std::size_t t = 0; t < area.size(); ++t) area[t] = triangle_area(mesh, t);
    set_attribute(mesh.triangle_attributes, "flux", result.triangle.flux);
    set_attribute(mesh.triangle_attributes, "flux_error", result.triangle.error);
    set_attribute(mesh.triangle_attributes, "area", std::move(area));
    set_attribute(mesh.vertex_attributes, "flux", result.vertex.flux);
    set_attribute(mesh.vertex_attributes, "flux_error", result.vertex.error);
    surface::write_mesh(path, mesh, metadata);
}

Json found_json(const flux::FoundFlux& found) {
    const double seconds = found.seconds - found.solve_seconds;
    Json json;
    json["method"] = found.radiosity ? "radiosity" : "monte-carlo";
    json["rays"] = found.emitted;
    json["segments"] = found.segments;
    json["seconds"]["trace"] = seconds;
    json["rays_per_second"] = static_cast<double>(found.emitted) / seconds;
    json["segments_per_second"] = static_cast<double>(found.segments) / seconds;
    if (found.radiosity) {
        json["seconds"]["solve"] = found.solve_seconds;
        json["unknowns"] = found.unknowns;
        json["nonzeros"] = found.samples;
        json["iterations"] = found.iterations;
    } else {
        json["arrivals"] = found.arrivals;
        json["absorbed"] = found.absorbed;
        json["escaped"] = found.escaped;
        json["rescued"] = found.rescued;
    }
    json["escaped_fraction"] = found.escaped_fraction;
    json["leaked"] = found.leaked;
    json["relative_error"] = found.relative_error;
    if (found.radiosity) {
        json["statistical_error"] = found.statistical_error;
        json["discretisation_error"] = found.discretisation_error;
        json["residual_rays"] = found.residual_rays;
    }
    if (found.choice && found.choice->why_not.empty())
        json["auto"] = {{"relative_error", found.choice->target},
                        {"monte_carlo_cost", found.choice->monte_carlo_cost},
                        {"radiosity_cost", found.choice->radiosity_cost},
                        {"spent", found.choice->spent}};
    return json;
}

void print_flux_summary(const Json& json) {
    fmt::print("{}: {} triangles, {} rays, {} segments in {:.3g} s ({:.3g} rays/s)\n", json["method"],
               json["triangles"], json["rays"], json["segments"], json["seconds"]["trace"],
               json["rays_per_second"]);
    if (json.contains("iterations"))
        fmt::print("{} unknowns, {} nonzeros, {} iterations in {:.3g} s\n", json["unknowns"],
                   json["nonzeros"], json["iterations"], json["seconds"]["solve"]);
    fmt::print(
        "flux (1 on an open plane): mean {:.4g}, least {:.4g}, largest {:.4g} of a triangle; "
        "relative error of vertex flux {:.3g}{}\n",
        json["flux"]["mean"], json["flux"]["min"], json["flux"]["max"], json["relative_error"],
        json.contains("discretisation_error")
            ? fmt::format(" ({:.2g} of rays, {:.2g} of linear elements)", json["statistical_error"],
                          json["discretisation_error"])
            : "");
    if (json.contains("absorbed"))
        fmt::print("absorbed {}, escaped {}, leaked {}\n", json["absorbed"], json["escaped"], json["leaked"]);
    else
        fmt::print("escaped {:.4g} of the particles, {} rays leaked\n", json["escaped_fraction"],
                   json["leaked"]);
}

}  // namespace sidewall::app
