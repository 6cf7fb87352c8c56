#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/report/html_table.hpp"
#include "app/report/view.hpp"
#include "surface/cut.hpp"

// What the kinds of folders put on a page: lists of sections, which app/report/page.js draws by their "type".
namespace sidewall::app {

/// Sections in their order, and what the page says at its top.
struct Page {
    std::string kind, title;
    Json facts;                      ///< [[name, value], ...]
    std::vector<std::string> notes;  ///< of what is unfinished or left out
    Json sections;
    std::size_t surfaces = 0;

    Page(std::string kind_of_folder, std::string title_of_page);
    void fact(const std::string& name, const std::string& value);
};

/// \param bytes  that the 3-D view may take.
Page run_page(const std::filesystem::path& folder, std::size_t bytes);
Page sweep_page(const std::filesystem::path& folder, std::size_t bytes);
Page fit_page(const std::filesystem::path& folder, std::size_t bytes);
Page comparison_page(const std::filesystem::path& folder, std::size_t bytes);

/// The recipe as its author wrote it, where the file is still there, and DIR/recipe.toml with every default.
/// \param effective  file of the effective recipe.
/// \param source     that a summary names; may be empty.
Json recipe_section(const std::filesystem::path& effective, const std::string& source);

/// The planes that a folder's recipe asks to be cut: its profiles, else that of its metrology, else y = 0.
std::vector<surface::Plane> planes_of(const std::filesystem::path& effective);

/// Puts surfaces into the page's 3-D view, and under it their profiles in the planes of a recipe; nothing if there are none.
/// \param title  of the view; empty: its own.
void add_view(std::vector<ViewFrame> frames, const std::filesystem::path& effective, std::size_t bytes,
              const std::string& title, const std::string& profiles_title, Page& page);

/// A table, whose numbers are right-aligned and which sorts by any column.
/// \param units  of columns by name; may lack some.
Json table_section(const std::string& title, const TextTable& table, const Json& units);

/// A folder's own name, also of "." and with a slash behind.
std::string folder_name(const std::filesystem::path& folder);

/// A number as a person reads it, "-" where it is none.
std::string number_text(const Json& json, int digits = 5);

/// A text under a key, or "".
std::string text_at(const Json& json, const std::string& key);

/// JSON numbers where fields are numbers, null where they are empty, else text.
Json field_json(const std::string& field);

}  // namespace sidewall::app
