#include "app/results/result.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <map>
#include <utility>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "app/common/timing.hpp"
#include "app/common/version.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

/// The value of an XML attribute within a tag; empty if it has none.
std::string_view tag_attribute(std::string_view tag, std::string_view name) {
    const std::string key = fmt::format(" {}=\"", name);
    const std::size_t at = tag.find(key);
    if (at == std::string_view::npos) return {};
    const std::size_t begin = at + key.size();
    return tag.substr(begin, tag.find('"', begin) - begin);
}

constexpr std::string_view kSurface = "surface";

/// K of a file interface_NNNN_K.vtp that belongs to \p surface, surface_NNNN.vtp; nothing for other files.
std::optional<std::size_t> interface_number(const fs::path& file, const fs::path& surface) {
    const std::string name = file.stem().string(),
                      start = "interface" + surface.stem().string().substr(kSurface.size()) + "_";
    if (!name.starts_with(start) || file.extension() != surface.extension()) return std::nullopt;
    std::size_t number = 0;
    return surface::read_number(std::string_view(name).substr(start.size()), number) ? std::optional(number)
                                                                                     : std::nullopt;
}

using Is = bool (Json::*)() const noexcept;

bool has(const Json& json, const std::string& pointer, Is is) {
    const Json::json_pointer at(pointer);
    return json.contains(at) && (json.at(at).*is)();
}

// Undoes surface::xml_escape for the value of an XML attribute.
std::string plain_text(std::string text) {
    for (const auto& [entity, character] :
         {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&amp;", "&"}})
        boost::replace_all(text, entity, character);
    return text;
}

// Whether \p wanted is the name, number or label of a step such as "2.1 etch (cycle 3 of 10)".
bool is_step(const std::string& label, const std::string& wanted) {
    const std::size_t blank = label.find(' ');
    if (label.empty() || blank == std::string::npos) return false;
    const std::string name = label.substr(blank + 1);
    return label == wanted || label.substr(0, blank) == wanted || name == wanted ||
           name.substr(0, name.rfind(" (cycle ")) == wanted;
}

/// Advice about a damaged summary.json.
constexpr const char* kSummaryAdvice = "remove it, and run --resume writes it anew";

// The first entry that a summary lacks or holds with another type than runs write, e.g. "timing"; nothing if
// it is whole. Readers check this first, as the file may be damaged.
std::optional<std::string> missing_in_summary(const Json& summary) {
    if (!summary.is_object()) return "an object";
    std::vector<std::pair<std::string, Is>> entries;
    for (const char* key : {"version", "length_unit", "time_unit"})
        entries.emplace_back(key, &Json::is_string);
    for (const char* key : {"grid_spacing", "time", "time_steps", "mesh/raw/vertices", "mesh/raw/triangles",
                            "mesh/simplified/vertices", "mesh/simplified/triangles"})
        entries.emplace_back(key, &Json::is_number);
    const Json phases = Timing();
    for (const auto& [name, none] : phases.items()) entries.emplace_back("timing/" + name, &Json::is_number);
    for (const char* key : {"metrology", "metrology_units"}) entries.emplace_back(key, &Json::is_object);
    for (const auto& [key, is] : entries)
        if (!has(summary, "/" + key, is)) return key;
    for (const auto& [list, key] : {std::pair("events", "/kind"), {"steps", "/stopped_by"}}) {
        const Json items = summary.value(list, Json());
        if (!items.is_array() || !std::ranges::all_of(items, [&, &key = key](const Json& item) {
                return has(item, key, &Json::is_string);
            }))
            return list;
    }
    for (const auto& [name, figure] : summary["metrology"].items())
        if (!(figure.is_number() || figure.is_null()) ||
            !summary["metrology_units"].value(name, Json()).is_string())
            return "metrology";
    return std::nullopt;
}

// The texts of a list of the metadata, control characters escaped; empty if there is no such list.
std::vector<std::string> metadata_list(const surface::MeshMetadata& metadata, const std::string& name) {
    const auto found = std::ranges::find(metadata.texts, name, [](const auto& text) { return text.first; });
    if (found == metadata.texts.end() || found->second.empty()) return {};
    const std::string& text = found->second;
    // Files of older versions have commas between the texts.
    std::vector<std::string> list = split(text, text.find('\0') == std::string::npos ? ',' : '\0');
    for (std::string& part : list) part = surface::printable(part, true);
    return list;
}

}  // namespace

std::vector<SavedSurface> saved_surfaces(const fs::path& folder) {
    const fs::path list = folder / "surface.pvd";
    if (!fs::exists(list))
        throw FileError("{}: has no surface.pvd: name a mesh or a folder that `sidewall run` wrote",
                        folder.string());
    const std::string text = surface::read_whole_file(list);
    if (text.find("<VTKFile") != std::string::npos && text.find("</VTKFile>") == std::string::npos)
        throw FileError("{}: ends too early, it is damaged: run the simulation again", list.string());
    // Besides surfaces, the list has their interfaces and the simplified meshes that were traced.
    std::vector<SavedSurface> saved;
    for (std::size_t at = text.find("<DataSet"); at != std::string::npos;
         at = text.find("<DataSet", at + 1)) {
        const std::string_view tag = std::string_view(text).substr(at, text.find('>', at) - at),
                               time = tag_attribute(tag, "timestep"), name = tag_attribute(tag, "file");
        if (name.empty())
            throw FileError("{}: a DataSet names no file: run the simulation again", list.string());
        SavedSurface entry{.number = saved.size(),
                           .file = folder / fs::path(name).filename(),  // never outside of the folder
                           .after = plain_text(std::string(tag_attribute(tag, "after")))};
        std::from_chars(time.data(), time.data() + time.size(), entry.time);
        const std::string stem = entry.file.stem().string();
        if (!saved.empty() && interface_number(entry.file, saved.back().file))
            saved.back().interfaces.push_back(entry.file);
        if (!stem.starts_with(kSurface)) continue;
        const std::size_t digits = stem.find_first_of("0123456789");
        if (digits != std::string::npos)
            std::from_chars(stem.data() + digits, stem.data() + stem.size(), entry.number);
        saved.push_back(std::move(entry));
    }
    if (saved.empty())
        throw FileError("{}: lists no surface, no file named surface_*: has the run saved one yet?",
                        list.string());
    return saved;
}

const SavedSurface& saved_at(const std::vector<SavedSurface>& saved, double time) {
    const auto [first, last] = std::ranges::minmax_element(saved, {}, &SavedSurface::time);
    // A time beyond those saved is refused: the nearest surface would be a wrong answer.
    const double slack = 1e-6 * std::max(std::abs(first->time), std::abs(last->time));
    if (!(time >= first->time - slack && time <= last->time + slack))
        throw RecipeError(
            "--time {:.9g}: the run saved surfaces from time {:.9g} to {:.9g}: choose one of these", time,
            first->time, last->time);
    const SavedSurface* nearest = &saved.front();
    for (const SavedSurface& surface : saved)
        if (std::abs(surface.time - time) <= std::abs(nearest->time - time)) nearest = &surface;
    return *nearest;
}

const SavedSurface& saved_after(const std::vector<SavedSurface>& saved, const std::string& step) {
    std::vector<std::string> steps;
    for (const SavedSurface& surface : saved)
        if (!surface.after.empty()) steps.push_back(surface.after);
    for (auto surface = saved.rbegin(); surface != saved.rend(); ++surface)
        if (is_step(surface->after, step)) return *surface;
    constexpr std::size_t kMost = 20;
    if (steps.size() > kMost) steps.erase(steps.begin() + kMost / 2, steps.end() - kMost / 2);
    throw RecipeError(
        "--step {}: no surface was saved at the end of such a step; there {}: choose one, or run with "
        "[output] every = \"end\"",
        step, steps.empty() ? "is none" : fmt::format("are {}", fmt::join(steps, ", ")));
}

const SavedSurface& saved_number(const std::vector<SavedSurface>& saved, long long number) {
    std::size_t least = saved.front().number, most = least;
    for (const SavedSurface& surface : saved) {
        if (number >= 0 && surface.number == static_cast<std::size_t>(number)) return surface;
        least = std::min(least, surface.number);
        most = std::max(most, surface.number);
    }
    throw RecipeError("--frame {}: the run saved the surfaces {} to {}: choose one of these", number, least,
                      most);
}

Result read_saved(const fs::path& folder, const SavedSurface& saved) {
    Result result;
    result.folder = folder;
    result.source = saved.file;
    result.surface = surface::read_mesh(saved.file, &result.metadata);
    for (const fs::path& file : saved.interfaces) result.interfaces.push_back(surface::read_mesh(file));
    return result;
}

std::vector<TriangleMesh> interfaces_beside(const fs::path& surface) {
    const fs::path folder = surface.has_parent_path() ? surface.parent_path() : ".";
    std::map<std::size_t, fs::path> files;
    std::error_code unreadable;  // then there are no interfaces
    if (surface.filename().string().starts_with(kSurface))
        for (const auto& entry : fs::directory_iterator(folder, unreadable))
            if (const auto k = interface_number(entry.path(), surface)) files[*k] = entry.path();
    std::vector<TriangleMesh> interfaces;
    interfaces.reserve(files.size());
    for (const auto& [k, file] : files) interfaces.push_back(surface::read_mesh(file));
    return interfaces;
}

Result read_result(const fs::path& path) {
    Result result;
    result.source = path;
    if (!fs::exists(path)) throw FileError("{}: no such file or folder: check the path", path.string());
    if (!fs::is_directory(path)) {
        result.surface = surface::read_mesh(path, &result.metadata);
        return result;
    }
    const std::vector<SavedSurface> saved = saved_surfaces(path);
    result =
        read_saved(path, *std::ranges::max_element(saved.rbegin(), saved.rend(), {}, &SavedSurface::time));
    if (fs::exists(path / "summary.json")) result.summary = read_summary(path);
    return result;
}

Json read_summary(const fs::path& folder) {
    return read_json(folder / "summary.json", kSummaryAdvice);
}

std::string metadata_text(const surface::MeshMetadata& metadata, const std::string& name,
                          const std::string& otherwise) {
    for (const auto& [key, text] : metadata.texts)
        if (key == name) return surface::printable(text, true);
    return otherwise;
}

std::optional<double> metadata_number(const surface::MeshMetadata& metadata, const std::string& name) {
    for (const auto& [key, number] : metadata.numbers)
        if (key == name) return number;
    return std::nullopt;
}

Materials materials_of(const surface::MeshMetadata& metadata) {
    const auto names = metadata_list(metadata, "materials"),
               colours = metadata_list(metadata, "material_colours");
    if (names.empty()) return default_materials();
    Materials materials;
    for (const std::string& name : names) {
        Material material;
        material.name = name;
        const auto known = material_id(default_materials(), name);
        if (known) material = default_materials()[static_cast<std::size_t>(*known)];
        if (materials.size() < colours.size() && !colours[materials.size()].empty())
            material.colour = colours[materials.size()];
        materials.push_back(std::move(material));
    }
    return materials;
}

double figure_of(const Json& summary, const std::string& name) {
    const Json::json_pointer at = Json::json_pointer("/metrology") / name;
    return summary.contains(at) && summary[at].is_number() ? summary[at].get<double>() : std::nan("");
}

bool has_other_version(const Json& summary) {
    return has(summary, "/version", &Json::is_string) && summary["version"] != version();
}

std::optional<Json> own_summary(const fs::path& folder) {
    try {
        Json summary = read_summary(folder);
        if (missing_in_summary(summary) || has_other_version(summary)) return std::nullopt;
        return summary;
    } catch (const FileError&) {  // missing, or cut off
        return std::nullopt;
    }
}

Json read_whole_summary(const fs::path& folder) {
    Json summary = read_summary(folder);
    require_whole(summary, folder);
    return summary;
}

void require_whole(const Json& summary, const fs::path& folder) {
    if (const auto missing = missing_in_summary(summary))
        throw FileError("{}: is damaged: it lacks {} as a run writes it; {}",
                        (folder / "summary.json").string(), *missing, kSummaryAdvice);
}

}  // namespace sidewall::app
