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

/// The number that is the whole of the text; nothing if it is none or not finite. A + before it makes it none.
std::optional<double> finite_number(std::string_view text);

/// A field of a CSV row: in quotes if its text asks for them.
std::string csv_field(const std::string& text);

/// The rows of a CSV text (RFC 4180) as fields without their quotes; after a last line break comes one more, of an empty field.
std::vector<std::vector<std::string>> csv_rows(std::string_view text);

/// A word of a command line: in quotes if a shell would read it otherwise, and without characters that a terminal obeys.
std::string shell_word(const std::string& text);

/// 64 bits of FNV-1a as hexadecimal digits, which differ for different texts.
std::string digest(std::string_view text);

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

/// Reads rows of finite numbers. Commas, semicolons, tabs or blanks separate them, whichever the first row has or Excel's
/// `sep=;` before it names; beside semicolons and tabs a decimal comma is read, too. The first row has headings, such as `x [nm]`, if no field of it begins as
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
