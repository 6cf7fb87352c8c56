#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// The parts of \p text between separators: one more than there are separators, empty ones included.
std::vector<std::string> split(std::string_view text, char separator);

/// The text without the blanks, tabs and carriage returns at its ends.
std::string_view trimmed(std::string_view text);

/// The number that the whole text is; nothing if it is no number, is not finite or begins with a +.
std::optional<double> finite_number(std::string_view text);

/// \p text as a field of a CSV row: in quotes if it has a comma, a quote or a line break.
std::string csv_field(const std::string& text);

/// The rows of a CSV text (RFC 4180), fields without quotes. A line break at the end is followed by one more
/// row, which has one empty field.
std::vector<std::vector<std::string>> csv_rows(std::string_view text);

/// \p text as a word of a command line: in quotes if a shell needs them, control characters as octal digits.
std::string shell_word(const std::string& text);

/// The 64-bit FNV-1a hash as hexadecimal digits; different texts hardly ever share it.
std::string digest(std::string_view text);

/// A column of numbers with its heading.
struct CsvColumn {
    std::string name;            ///< without its unit; "column N" in a table without headings
    std::string unit;            ///< in brackets or after a slash behind the name; or ""
    std::vector<double> values;  ///< as many in every column; meaningless if there is a fault
    std::string fault;           ///< file, line and text of its first field that is no number; or ""
};

/// A table of numbers from a CSV file.
struct CsvTable {
    std::string file;
    bool headed = false;  ///< its first row names the columns
    std::vector<CsvColumn> columns;
    std::string understood;  ///< how it was read, in words
};

/// Reads rows of finite numbers. The separator is the one that Excel's row `sep=;` names, or else the first
/// of semicolon, tab, comma and blank that the first row has; decimal commas are read unless it is the comma.
/// The first row holds headings, such as `x [nm]`, if none of its fields begins as a number does. Fields may
/// be in quotes and have a Unicode minus. Byte order marks, empty rows and what follows a # are left out.
/// \param name  of the file, for messages.
/// \throws FileError, with the line, for rows of different lengths, none or over \p most_rows rows, and what
///         is no number in a table without headings; in one with headings that is the column's fault.
CsvTable parse_csv(std::string_view text, const std::string& name, std::size_t most_rows = 1'000'000);

/// Reads a file of at most 100 MB as parse_csv() does.
CsvTable read_csv(const std::filesystem::path& path, std::size_t most_rows = 1'000'000);

/// The numbers of a column.
/// \throws FileError if the column has a fault.
const std::vector<double>& numbers_of(const CsvColumn& column);

/// A CSV file as texts, without quotes.
struct TextTable {
    std::vector<std::string> names;
    std::vector<std::vector<std::string>> rows;  ///< each as long as names

    /// The index of the column called \p name; a unit in brackets is not compared.
    std::optional<std::size_t> column(std::string_view name) const;
};

/// Reads a table that this program wrote. Leaves out a last row that is cut off, as by a run that was killed.
/// \throws FileError naming file and row for a whole row of another length than the names.
TextTable read_text_table(const std::filesystem::path& path);

/// Splits "depth [um]" into "depth" and "um"; the unit is "" where there is none.
std::pair<std::string, std::string> name_and_unit(const std::string& heading);

}  // namespace sidewall::app
