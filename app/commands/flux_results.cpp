#include "app/commands/flux_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

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

void add_rates(Json& json, std::uint64_t rays, std::uint64_t segments, double seconds) {
    json["rays"] = rays;
    json["segments"] = segments;
    json["seconds"]["trace"] = seconds;
    json["rays_per_second"] = static_cast<double>(rays) / seconds;
    json["segments_per_second"] = static_cast<double>(segments) / seconds;
}

}  // namespace

void write_flux(const std::string& path, TriangleMesh mesh, const flux::TallyFlux& result) {
    if (std::filesystem::path(path).extension() == ".csv") return write_file(path, csv_text(mesh, result));
    std::vector<double> area(mesh.triangles.size());
    for (std::size_t t = 0; t < area.size(); ++t) area[t] = triangle_area(mesh, t);
    set_attribute(mesh.triangle_attributes, "flux", result.triangle.flux);
    set_attribute(mesh.triangle_attributes, "flux_error", result.triangle.error);
    set_attribute(mesh.triangle_attributes, "area", std::move(area));
    set_attribute(mesh.vertex_attributes, "flux", result.vertex.flux);
    set_attribute(mesh.vertex_attributes, "flux_error", result.vertex.error);
    surface::write_mesh(path, mesh);
}

Json traced_json(const flux::FluxResult& result) {
    Json json;
    json["method"] = "monte-carlo";
    add_rates(json, result.emitted, result.segments, result.seconds);
    json["arrivals"] = result.arrivals;
    json["absorbed"] = result.absorbed;
    json["escaped"] = result.escaped;
    json["escaped_fraction"] = static_cast<double>(result.escaped) / static_cast<double>(result.emitted);
    json["leaked"] = result.leaked;
    json["rescued"] = result.rescued;
    json["relative_error"] = result.relative_error;
    return json;
}

Json solved_json(const flux::Exchange& exchange, const flux::RadiosityFlux& result) {
    Json json;
    json["method"] = "radiosity";
    add_rates(json, exchange.rays(), exchange.segments(), exchange.seconds());
    json["seconds"]["solve"] = result.seconds;
    json["unknowns"] = exchange.unknowns();
    json["nonzeros"] = exchange.samples();
    json["iterations"] = result.iterations;
    json["escaped_fraction"] = result.escaped;
    json["leaked"] = exchange.leaked();
    json["relative_error"] = result.relative_error;
    json["statistical_error"] = result.statistical_error;
    json["discretisation_error"] = result.discretisation_error;
    json["residual_rays"] = exchange.residual_rays();
    return json;
}

void print_flux_summary(const Json& json) {
    fmt::print("{}: {} triangles, {} rays, {} segments in {:.3g} s ({:.3g} rays/s)\n",
               json["method"].get<std::string>(), json["triangles"].get<std::size_t>(),
               json["rays"].get<std::uint64_t>(), json["segments"].get<std::uint64_t>(),
               json["seconds"]["trace"].get<double>(), json["rays_per_second"].get<double>());
    if (json.contains("iterations"))
        fmt::print("{} unknowns, {} nonzeros, {} iterations in {:.3g} s\n",
                   json["unknowns"].get<std::size_t>(), json["nonzeros"].get<std::uint64_t>(),
                   json["iterations"].get<std::uint32_t>(), json["seconds"]["solve"].get<double>());
    fmt::print(
        "flux (1 on an open plane): mean {:.4g}, least {:.4g}, largest {:.4g} of a triangle; "
        "relative error of vertex flux {:.3g}{}\n",
        json["flux"]["mean"].get<double>(), json["flux"]["min"].get<double>(),
        json["flux"]["max"].get<double>(), json["relative_error"].get<double>(),
        json.contains("discretisation_error")
            ? fmt::format(" ({:.2g} of rays, {:.2g} of linear elements)",
                          json["statistical_error"].get<double>(), json["discretisation_error"].get<double>())
            : "");
    if (json.contains("absorbed"))
        fmt::print("absorbed {}, escaped {}, leaked {}\n", json["absorbed"].get<std::uint64_t>(),
                   json["escaped"].get<std::uint64_t>(), json["leaked"].get<std::uint64_t>());
    else
        fmt::print("escaped {:.4g} of the particles, {} rays leaked\n",
                   json["escaped_fraction"].get<double>(), json["leaked"].get<std::uint64_t>());
}

}  // namespace sidewall::app
