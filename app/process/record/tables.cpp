#include "app/process/record/tables.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/text.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::app {
std::string timeline_header(const Recipe& recipe, const std::vector<Measure>& measures) {
    const auto& length = recipe.domain.length_unit;
    const auto& time = recipe.domain.time_unit;
    std::string header = fmt::format(
        "step,name,time [{0}],dt [{0}],max_speed [{1}/{0}],raw_vertices,raw_triangles,simplified_vertices,"
        "simplified_triangles,segments,leaked,relative_error",
        time, length);
    for (const Measure& m : measures) header += "," + csv_field(fmt::format("{} [{}]", m.name, m.unit));
    return header + "\n";
}

std::string timeline_row(const RunState& state, const Step& step, const TracedSurface& surface,
                         const TimeStep& next) {
    const auto& traced = surface.traced();
    std::uint64_t segments = 0, leaked = 0;
    double error = 0.0;
    // Fluxes of an earlier time step have no error of their own.
    const bool reused = surface.arriving && !surface.arriving->trace;
    if (surface.arriving && surface.arriving->trace)
        for (const flux::FluxResult& flux : surface.arriving->trace->species) {
            if (flux.pass_place == 0) segments += flux.segments;
            leaked += flux.leaked;
            error = std::max(error, flux.relative_error);
        }
    return fmt::format("{},{},{:.9g},{:.9g},{:.9g},{},{},{},{},{},{},{}", state.step + 1,
                       csv_field(step.name), state.process_time(), next.dt, next.speed,
                       surface.raw.vertices.size(), surface.raw.triangles.size(), traced.vertices.size(),
                       traced.triangles.size(), segments, leaked,
                       reused ? std::string() : fmt::format("{:.6g}", error));
}

std::string timeline_end_row(const RunState& state, const Step& step, const TriangleMesh& surface) {
    return fmt::format("{},{},{:.9g},,,{},{},,,,,", state.step + 1, csv_field(step.name),
                       state.process_time(), surface.vertices.size(), surface.triangles.size());
}

std::vector<std::size_t> row_ends(const std::string& text, std::size_t most) {
    std::vector<std::size_t> ends{0};
    bool quoted = false;  // names of steps held line breaks in earlier versions
    for (std::size_t at = 0; at < text.size() && ends.size() <= most; ++at) {
        if (text[at] == '"') quoted = !quoted;
        if (text[at] == '\n' && !quoted) ends.push_back(at + 1);
    }
    return ends;
}

std::string pvd_text(const std::vector<SavedFile>& files) {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const SavedFile& file : files)
        text += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" file=\"{}\" after=\"{}\"/>\n",
                            file.time, file.part, file.name, surface::xml_escape(file.after));
    return text + "  </Collection>\n</VTKFile>\n";
}

}  // namespace sidewall::app
