#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// A CSV file as texts without their quotes.
struct TextTable {
    std::vector<std::string> names;
    std::vector<std::vector<std::string>> rows;  ///< each as long as names

    /// The column of that name, a unit in brackets aside.
    std::optional<std::size_t> column(std::string_view name) const;
};

/// Reads a table that this program wrote. Leaves out a last row that is cut off, as by a run that was killed.
/// \throws FileError naming file and row for a whole row of another length than the names.
TextTable read_text_table(const std::filesystem::path& path);

/// Splits "depth [um]" into "depth" and "um"; the unit is "" where there is none.
std::pair<std::string, std::string> name_and_unit(const std::string& heading);

}  // namespace sidewall::app
