#include "app/results/result.hpp"

#include <fmt/format.h>

#include <charconv>

#include "app/common/text.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"

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

}  // namespace

std::vector<PvdEntry> read_pvd(const std::filesystem::path& path) {
    const std::string text = surface::read_whole_file(path);
    std::vector<PvdEntry> entries;
    for (std::size_t at = text.find("<DataSet"); at != std::string::npos;
         at = text.find("<DataSet", at + 1)) {
        const std::string_view tag = std::string_view(text).substr(at, text.find('>', at) - at);
        PvdEntry entry;
        const std::string_view time = tag_attribute(tag, "timestep");
        std::from_chars(time.data(), time.data() + time.size(), entry.time);
        const std::string_view file = tag_attribute(tag, "file");
        if (file.empty())
            throw FileError(
                fmt::format("{}: a DataSet names no file: run the simulation again", path.string()));
        entry.file = path.parent_path() / std::string(file);
        entries.push_back(std::move(entry));
    }
    if (entries.empty())
        throw FileError(fmt::format("{}: lists no surface: has the run saved one yet?", path.string()));
    return entries;
}

Result read_result(const std::filesystem::path& path) {
    Result result;
    result.source = path;
    if (!std::filesystem::is_directory(path)) {
        result.surface = surface::read_mesh(path, &result.metadata);
        return result;
    }
    result.folder = path;
    if (!std::filesystem::exists(path / "surface.pvd"))
        throw FileError(fmt::format(
            "{}: has no surface.pvd: name a mesh or a folder that `sidewall run` wrote", path.string()));
    const auto entries = read_pvd(path / "surface.pvd");
    // Beside the surface itself, runs list interfaces and the simplified mesh that was traced.
    const auto is = [](const PvdEntry& entry, const char* kind) {
        return entry.file.filename().string().starts_with(kind);
    };
    const PvdEntry* last = nullptr;
    for (const PvdEntry& entry : entries)
        if (is(entry, "surface") && (!last || entry.time >= last->time)) last = &entry;
    if (!last)
        throw FileError(fmt::format("{}: lists no file named surface_*: has the run saved a surface yet?",
                                    (path / "surface.pvd").string()));
    result.source = last->file;
    result.surface = surface::read_mesh(last->file, &result.metadata);
    for (const PvdEntry& entry : entries)
        if (is(entry, "interface") && entry.time == last->time)
            result.interfaces.push_back(surface::read_mesh(entry.file));
    if (std::filesystem::exists(path / "summary.json")) result.summary = read_summary(path);
    return result;
}

Json read_summary(const std::filesystem::path& folder) {
    return read_json(folder / "summary.json", "run the simulation again");
}

std::string metadata_text(const surface::MeshMetadata& metadata, const std::string& name,
                          const std::string& otherwise) {
    for (const auto& [key, text] : metadata.texts)
        if (key == name) return text;
    return otherwise;
}

Materials materials_of(const surface::MeshMetadata& metadata) {
    const std::string names = metadata_text(metadata, "materials", "");
    if (names.empty()) return default_materials();
    const auto colours = split(metadata_text(metadata, "material_colours", ""), ',');
    Materials materials;
    for (const std::string& name : split(names, ',')) {
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

}  // namespace sidewall::app
