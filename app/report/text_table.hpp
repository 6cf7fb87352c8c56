#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// A CSV file as text, quotes taken off.
struct TextTable {
    std::vector<std::string> names;
    std::vector<std::vector<std::string>> rows;  ///< each as long as names

    /// The column of that name, or of that name before a unit in brackets.
    std::optional<std::size_t> column(std::string_view name) const;
};

/// Reads a table that this program wrote. A last row that is cut off, as by a run that was killed, is left out.
/// \throws FileError naming file and row for other rows of another length.
TextTable read_text_table(const std::filesystem::path& path);

/// "depth [um]" to "depth" and "um"; the unit is "" where there is none.
std::pair<std::string, std::string> name_and_unit(const std::string& heading);

}  // namespace sidewall::app
