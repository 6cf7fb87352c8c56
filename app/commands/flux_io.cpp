#include "app/commands/flux_io.hpp"

#include <fmt/format.h>

#include <iterator>
#include <utility>

#include "app/common/files.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {
namespace {

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
