#include "app/report/parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "app/common/files.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/step_materials.hpp"
#include "surface/cut.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostShownBytes = 200'000, kMostRows = 2000;

// Cuts a text that is too long for a page after a whole line.
std::string page_text(std::string text) {
    if (text.size() <= kMostShownBytes) return text;
    text.resize(text.rfind('\n', kMostShownBytes) + 1);
    return text + "# ... the rest is not shown on this page\n";
}

// Lines of \p text that \p other lacks or has fewer times.
std::string differing_lines(const std::string& text, const std::string& other) {
    std::vector<std::string> there = split(other, '\n');
    std::string lines;
    for (const std::string& line : split(text, '\n')) {
        const auto same = std::find(there.begin(), there.end(), line);
        if (same != there.end())
            there.erase(same);
        else
            lines += line + "\n";
    }
    return lines;
}

// Up to four planes in which a recipe asks for profiles; y = 0 if it cannot be read.
std::vector<surface::Plane> planes_of(const fs::path& effective) {
    constexpr std::size_t kMost = 4;
    std::vector<surface::Plane> planes;
    try {
        const Recipe recipe = load_recipe(effective);
        planes = profile_planes(recipe);
        if (planes.empty()) planes.push_back(surface::parse_plane(recipe.metrology.cut));
    } catch (const Error&) {  // files that the recipe names may be gone
        planes.push_back({});
    }
    if (planes.size() > kMost) planes.resize(kMost);
    return planes;
}

}  // namespace

void Page::fact(const std::string& name, const std::string& value) {
    if (!value.empty()) facts.push_back(Json::array({name, value}));
}

Json recipe_section(const std::string& title, const fs::path& effective, const std::string& source) {
    Json section{{"type", "recipe"}, {"title", title}};
    std::error_code failure;
    std::string text;
    if (fs::is_regular_file(effective, failure)) {
        text = surface::read_whole_file(effective);
        section["effective"] = page_text(text);
        try {
            section["by_material"] = page_text(values_by_material(parse_recipe(text, effective.string())));
        } catch (const Error&) {  // files that the recipe names may be gone
        }
    }
    if (source.empty()) return section;
    section["source_name"] = source;
    if (!fs::is_regular_file(source, failure)) {
        section["note"] = "The recipe file no longer exists, so that its comments are not shown.";
        return section;
    }
    const std::string written = surface::read_whole_file(source);
    try {
        const std::string now = effective_recipe(parse_recipe(written, source));
        section["source"] = page_text(written);
        if (!text.empty() && now != text) section["changed"] = page_text(differing_lines(text, now));
    } catch (const Error&) {
        section["note"] =
            "The recipe file is no valid recipe at present, so that its comments are not shown.";
    }
    return section;
}

void add_view(std::vector<ViewFrame> frames, const fs::path& effective, std::size_t bytes,
              const std::string& title, const std::string& profiles_title, Page& page) {
    if (frames.empty()) return;
    View view = make_view(std::move(frames), planes_of(effective), bytes);
    page.surfaces = view.shown;
    if (!title.empty()) view.section["title"] = title;
    page.sections.push_back(std::move(view.section));
    page.sections.push_back(charts_section(profiles_title, std::move(view.profiles), true));
}

Json charts_section(const std::string& title, Json charts, bool wide) {
    return {{"type", "charts"}, {"title", title}, {"wide", wide}, {"charts", std::move(charts)}};
}

Json plain_table(const std::string& title, const std::vector<std::string>& columns, Json rows) {
    Json section{{"type", "table"}, {"title", title}, {"columns", Json::array()}, {"rows", std::move(rows)}};
    for (const std::string& name : columns) section["columns"].push_back(Json{{"name", name}});
    return section;
}

std::optional<ViewFrame> last_frame(const fs::path& run, const std::string& label) {
    if (!is_there(run / "surface.pvd")) return std::nullopt;
    return ViewFrame{label, run, saved_surfaces(run).back()};
}

Json table_section(const std::string& title, const TextTable& table, const Json& units) {
    Json section{{"type", "table"}, {"title", title}, {"columns", Json::array()}, {"rows", Json::array()}};
    for (const std::string& heading : table.names) {
        auto [name, unit] = name_and_unit(heading);
        if (units.contains(heading)) unit = units[heading].get<std::string>();
        section["columns"].push_back(Json{{"name", name}, {"unit", shown_unit(unit)}});
    }
    for (const auto& row : table.rows) {
        if (section["rows"].size() == kMostRows) {
            section["note"] = fmt::format("The first {} of {} rows.", kMostRows, table.rows.size());
            break;
        }
        Json fields = Json::array();
        for (std::size_t k = 0; k < row.size(); ++k)  // text, not a number: the name of the run's folder
            fields.push_back(table.names[k] == "run" ? Json(row[k]) : field_json(row[k]));
        section["rows"].push_back(std::move(fields));
    }
    return section;
}

TextTable last_of_timeline(const fs::path& timeline) {
    constexpr std::streamoff kTail = 65'536;  // bytes; longer than any row
    std::ifstream file;
    std::string names(kTail, '\0'), tail;
    std::error_code failure;
    if (fs::is_regular_file(timeline, failure))  // opening a pipe would block
        file.open(timeline, std::ios::binary);
    if (!file.getline(names.data(), kTail))
        throw FileError("{}: cannot be read, or its first line has over {} bytes", timeline.string(), kTail);
    const std::streamoff begin = file.gcount();
    names.resize(names.find('\0'));
    file.clear();
    file.seekg(0, std::ios::end);
    const std::streamoff from = std::max(begin, std::streamoff{file.tellg()} - kTail);
    file.seekg(from);
    tail.assign(std::istreambuf_iterator<char>(file), {});
    if (from > begin) tail.erase(0, tail.find('\n') + 1);
    tail.resize(tail.rfind('\n') + 1);  // drops an incomplete row
    const std::vector<std::vector<std::string>> rows = csv_rows(names + "\n" + tail);
    TextTable table{.names = rows.front()};
    if (rows.size() > 2) table.rows.push_back(rows[rows.size() - 2]);
    if (rows.size() > 2 && table.rows.front().size() != table.names.size())
        throw FileError("{}: its last row is damaged", timeline.string());
    return table;
}

std::string folder_name(const fs::path& folder) {
    const fs::path whole = fs::absolute(folder).lexically_normal();
    return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

std::string number_text(const Json& json, int digits) {
    return json.is_number() ? fmt::format("{:.{}g}", json.get<double>(), digits) : "-";
}

std::string text_at(const Json& json, const std::string& key) {
    return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
}

Json field_json(const std::string& field) {
    if (field.empty()) return nullptr;
    const auto number = finite_number(field);
    if (!number) return field;
    return number_or_null(*number, 7);
}

}  // namespace sidewall::app
