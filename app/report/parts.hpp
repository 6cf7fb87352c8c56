#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/report/view.hpp"

// Sections that several pages share. app/report/page.js draws each by its "type".
namespace sidewall::app {

/// A page of results before it becomes HTML: the facts and notes at its top, then its sections.
struct Page {
    std::string kind, title;
    Json facts = Json::array();      ///< [[name, value], ...]
    std::vector<std::string> notes;  ///< what is unfinished or left out
    Json sections = Json::array();
    std::size_t surfaces = 0;

    void fact(const std::string& name, const std::string& value);
};

/// A section with a recipe: as its author wrote it, if that file still exists, and with every default.
/// \param effective  recipe.toml of the results' folder.
/// \param source     the author's file, as in summary.json; may be empty.
Json recipe_section(const std::string& title, const std::filesystem::path& effective,
                    const std::string& source);

/// A section of charts side by side, in wider columns if \p wide.
Json charts_section(const std::string& title, Json charts, bool wide = false);

/// A section with a table. Units are part of the column names or stand in a separate column.
Json plain_table(const std::string& title, const std::vector<std::string>& columns, Json rows);

/// The last surface that a run saved, if it saved one.
std::optional<ViewFrame> last_frame(const std::filesystem::path& run, const std::string& label);

/// Adds a 3-D view of surfaces to the page, and below it their profiles. The planes are those of the recipe's
/// output, else that of its metrology, else y = 0. Without surfaces it adds nothing.
/// \param bytes  most that the view may take.
/// \param title  of the view; empty: the default.
void add_view(std::vector<ViewFrame> frames, const std::filesystem::path& effective, std::size_t bytes,
              const std::string& title, const std::string& profiles_title, Page& page);

/// A section with a table that sorts by any column.
/// \param units  by heading, in place of those in the headings; may lack some.
Json table_section(const std::string& title, const TextTable& table, const Json& units);

/// The column names of a timeline.csv and its last complete row, if any; reads only both ends of the file.
/// \throws FileError if the file cannot be read, or the row has another length than the list of names.
TextTable last_of_timeline(const std::filesystem::path& timeline);

/// The last name in a folder's path, also for "." and with a trailing slash.
std::string folder_name(const std::filesystem::path& folder);

/// A number as text, "-" where \p json is none.
std::string number_text(const Json& json, int digits = 5);

/// The text under a key, or "".
std::string text_at(const Json& json, const std::string& key);

/// A field of a table as JSON: a number, null where it is empty, else text.
Json field_json(const std::string& field);

}  // namespace sidewall::app
