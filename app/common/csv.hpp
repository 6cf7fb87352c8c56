#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// A column of numbers with its heading.
struct CsvColumn {
    std::string name;            ///< without its unit; "column N" in a table without headings
    std::string unit;            ///< in brackets behind the name; or ""
    std::vector<double> values;  ///< as many in every column; nothing to go by if there is a fault
    std::string fault;           ///< file, line and text of its first field that is no number; or ""
};

/// A table of numbers from a CSV file.
struct CsvTable {
    std::string file;
    bool headed = false;  ///< its first row names the columns
    std::vector<CsvColumn> columns;
    std::string understood;  ///< how it was read, in words
};

/// Reads rows of finite numbers. Commas, semicolons, tabs or blanks separate them, whichever the first row has; beside
/// semicolons and tabs a decimal comma is read, too. The first row has headings, such as `x [nm]`, if no field of it begins as
/// a number does. Fields may stand in quotes, and a Unicode minus is one. Byte order marks, empty rows and what follows a # are left out.
/// \param name  of the file, for messages.
/// \throws FileError naming file and line, for rows of several lengths, over \p most_rows of them or none, and what is no number
///         in a table without headings; in one with headings that is the column's fault.
CsvTable parse_csv(std::string_view text, const std::string& name, std::size_t most_rows = 1'000'000);

/// Reads a file of at most 100 MB as parse_csv() does.
CsvTable read_csv(const std::filesystem::path& path, std::size_t most_rows = 1'000'000);

/// The numbers of a column.
/// \throws FileError if the column has a fault.
const std::vector<double>& numbers_of(const CsvColumn& column);

}  // namespace sidewall::app
