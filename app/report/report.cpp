#include "app/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <nlohmann/json.hpp>

#include "app/common/files.hpp"
#include "app/common/version.hpp"
#include "app/report/assets.hpp"
#include "app/report/parts.hpp"
#include "app/report/recipe_page.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::app {

// Pages by the kind of a folder; \p bytes is what the 3-D view may take.
Page run_page(const fs::path& folder, std::size_t bytes, const std::optional<SavedSurface>& only,
              bool later);                                        // run_page.cpp
Page comparison_page(const fs::path& folder, std::size_t bytes);  // evaluation_page.cpp
Page study_page(const fs::path& folder, std::size_t bytes);
Page validation_page(const fs::path& folder, std::size_t bytes);
Page sweep_page(const fs::path& folder, std::size_t bytes);  // batch_page.cpp
Page fit_page(const fs::path& folder, std::size_t bytes);

namespace {

// Bytes left for the 3-D view after scripts, style and the usual most of charts and tables.
std::size_t view_bytes() {
    constexpr std::size_t kTables = 700'000;
    return kMostPageBytes - page_html("", "").size() - kTables;
}

Page whole_run_page(const fs::path& folder, std::size_t bytes) {
    return run_page(folder, bytes, {}, false);
}

Page page_of(const fs::path& folder, std::size_t bytes) {
    using Maker = Page (*)(const fs::path&, std::size_t);
    constexpr std::pair<const char*, Maker> kPages[] = {
        {"sweep.json", sweep_page},           {"fit.json", fit_page},
        {"compare.json", comparison_page},    {"study.json", study_page},
        {"validation.json", validation_page}, {"summary.json", whole_run_page},
        {"surface.pvd", whole_run_page},      {"timeline.csv", whole_run_page}};
    for (const auto& [file, page] : kPages)
        if (is_there(folder / file)) return page(folder, bytes);
    throw FileError(
        "{}: holds no results: name a folder that `run`, `sweep`, `fit`, `compare`, `study` or `validate` wrote, which has a "
        "summary.json, surface.pvd, sweep.json, fit.json, compare.json, study.json or validation.json",
        folder.string());
}

// JSON for a script element: "<" is escaped, so that "</script>" or "<!--" in a string does not end it.
// Invalid UTF-8, as in a file's name, is replaced.
std::string script_json(const Json& json) {
    return boost::replace_all_copy(json.dump(-1, ' ', false, Json::error_handler_t::replace), "<", "\\u003c");
}

Report report_of(const Page& page) {
    const Json data{{"kind", page.kind},   {"title", page.title},       {"version", version()},
                    {"facts", page.facts}, {"notes", Json(page.notes)}, {"sections", page.sections}};
    Report report{.kind = page.kind, .html{}, .data = script_json(data), .surfaces = page.surfaces};
    report.html = page_html(surface::xml_escape(fmt::format("{}: {}", page.kind, page.title)), report.data);
    return report;
}

// The report of page(bytes), which makes a page whose view takes so many bytes; \p name is for messages.
template <class MakePage>
Report fitting_report(const std::string& name, const MakePage& page) {
    try {
        Report report = report_of(page(view_bytes()));
        // Texts and tables took more than kTables: the view gets that much less.
        if (const std::size_t size = report.html.size(); size > kMostPageBytes)
            report = report_of(page(view_bytes() - std::min(view_bytes(), size - kMostPageBytes)));
        if (report.html.size() > kMostPageBytes)
            throw FileError("{}: its page would take {} bytes, over {}: report one of its runs", name,
                            report.html.size(), kMostPageBytes);
        return report;
    } catch (const nlohmann::json::exception& error) {
        throw FileError(
            "{}: its JSON is not what this program writes ({}): it is damaged or of another "
            "version; make the results again",
            name, error.what());
    }
}

void require_folder(const fs::path& folder) {
    if (!is_there(folder)) throw FileError("{}: no such folder: check the path", folder.string());
    std::error_code failure;
    if (!fs::is_directory(folder, failure))
        throw FileError("{}: is a file: name the folder of results that holds it", folder.string());
}

}  // namespace

Report make_report(const fs::path& folder, const std::optional<SavedSurface>& only, bool later) {
    require_folder(folder);
    return fitting_report(folder.string(), [&](std::size_t bytes) {
        return only ? run_page(folder, bytes, only, later) : page_of(folder, bytes);
    });
}

Report make_report(const std::vector<fs::path>& runs) {
    for (const fs::path& run : runs) require_folder(run);
    return fitting_report(runs.front().string(), [&](std::size_t bytes) { return runs_page(runs, bytes); });
}

Report make_report(const Recipe& recipe) {
    return fitting_report(recipe.file, [&](std::size_t bytes) { return recipe_page(recipe, bytes); });
}

}  // namespace sidewall::app
