#include "app/common/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/case_conv.hpp>
#include <boost/algorithm/string/replace.hpp>
#include <boost/algorithm/string/split.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::uintmax_t kMostBytes = 100'000'000;
constexpr std::size_t kMostColumns = 1000, kQuoted = 40;  // characters of a text in a message

// Replaces the Unicode minus signs and no-break spaces that other programs write by ASCII.
std::string plain(std::string_view text) {
    std::string result(text);
    for (const auto& [sign, ascii] : {std::pair("\xe2\x88\x92", "-"),  // minus sign
                                      {"\xe2\x80\x93", "-"},           // en dash
                                      {"\xc2\xa0", " "},               // no-break space
                                      {"\xe2\x80\xaf", " "}})          // narrow no-break space
        boost::replace_all(result, sign, ascii);
    return result;
}

// The fields of a row without the quotes and blanks around them.
std::vector<std::string> fields_of(std::string_view row, char delimiter) {
    std::vector<std::string> fields(1);
    bool quoted = false;
    if (delimiter == ' ') row = trimmed(row);
    for (const char c : row) {
        const bool ends = delimiter == ' ' ? c == ' ' || c == '\t' : c == delimiter;
        if (c == '"')
            quoted = !quoted;
        else if (!ends || quoted)
            fields.back() += c;
        else if (delimiter != ' ' || !fields.back().empty())
            fields.emplace_back();
    }
    for (std::string& field : fields) field = trimmed(field);
    return fields;
}

// The delimiter that a row such as `sep=;`, which Excel writes before a table, names; 0 for other rows.
char delimiter_in(std::string row) {
    std::erase(row, '"');
    boost::to_lower(row);
    const bool names = row.size() == 5 && row.starts_with("sep=") &&
                       std::string_view(",;\t").find(row[4]) != std::string_view::npos;
    return names ? row[4] : '\0';
}

// Whether a field begins as a number does, or is nan or infinity: such a field is no heading.
bool begins_as_number(std::string text) {
    boost::to_lower(text);
    std::string_view rest = text;
    if (rest.starts_with('-') || rest.starts_with('+')) rest.remove_prefix(1);
    if (rest == "nan" || rest == "inf" || rest == "infinity") return true;
    if (rest.starts_with('.') || rest.starts_with(',')) rest.remove_prefix(1);
    return !rest.empty() && std::isdigit(static_cast<unsigned char>(rest[0])) != 0;
}

// Splits a heading into the name and the unit behind it, which is in brackets or after a slash.
CsvColumn column_of(const std::string& heading) {
    const std::size_t open = heading.find_first_of("[("), slash = heading.find('/');
    const auto part = [&](std::size_t from, std::size_t to) {
        return std::string(trimmed(std::string_view(heading).substr(from, to - from)));
    };
    if (slash < open) {
        const std::string unit = part(slash + 1, heading.size());
        const bool bracketed = unit.starts_with('(') && unit.ends_with(')');
        return {.name = part(0, slash), .unit = bracketed ? unit.substr(1, unit.size() - 2) : unit};
    }
    if (open == std::string::npos) return {.name = heading};
    const std::size_t close = heading.find_first_of("])", open);
    return {.name = part(0, open), .unit = part(open + 1, std::min(close, heading.size()))};
}

// The format of a table, as far as the rows read so far show it.
struct Style {
    char delimiter = 0;
    bool points = false, commas = false;  // numbers have had decimal points, or commas
};

std::optional<double> number(std::string text, Style& style) {
    const std::size_t comma = style.delimiter == ',' ? std::string::npos : text.find(',');
    if (comma != std::string::npos) text[comma] = '.';
    const bool plus = text.starts_with('+') && !text.starts_with("+-");
    const auto value = finite_number(std::string_view(text).substr(plus ? 1 : 0));
    if (value)
        (comma != std::string::npos ? style.commas : style.points) |= text.find('.') != std::string::npos;
    return value;
}

std::string reading_note(const CsvTable& table, const Style& style) {
    const char* const between = style.delimiter == ','    ? "commas"
                                : style.delimiter == ';'  ? "semicolons"
                                : style.delimiter == '\t' ? "tabs"
                                                          : "blanks";
    std::string text = fmt::format("{} rows of {} between {}{}", table.columns[0].values.size(),
                                   table.columns.size(), between, style.commas ? ", decimal commas" : "");
    if (!table.headed) return text + ", no headings";
    std::vector<std::string> headings;
    headings.reserve(table.columns.size());
    for (const CsvColumn& column : table.columns)
        headings.push_back(surface::printable(
            column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit)));
    return fmt::format("{}, headings {}", text, fmt::join(headings, ", "));
}

}  // namespace

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> parts;
    boost::split(parts, text, [&](char c) { return c == separator; });
    return parts;
}

std::string_view trimmed(std::string_view text) {
    constexpr const char* kBlank = " \t\r";
    const std::size_t begin = text.find_first_not_of(kBlank);
    return begin == std::string_view::npos ? std::string_view()
                                           : text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::optional<double> finite_number(std::string_view text) {
    double value = 0.0;
    return surface::read_number(text, value) && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    return "\"" + boost::replace_all_copy(text, "\"", "\"\"") + "\"";
}

std::vector<std::vector<std::string>> csv_rows(std::string_view text) {
    std::vector<std::vector<std::string>> rows(1, std::vector<std::string>(1));
    bool quoted = false;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char c = text[at];
        if (c == '"' && quoted && text.substr(at + 1).starts_with('"'))
            rows.back().back() += text[++at];
        else if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            rows.back().emplace_back();
        else if (c == '\n' && !quoted)
            rows.emplace_back(1);
        else if (c != '\r')
            rows.back().back() += c;
    }
    return rows;
}

std::string shell_word(const std::string& text) {
    const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 ||
               std::string_view("_-./=+,:@%").find(static_cast<char>(c)) != std::string_view::npos;
    });
    if (plain) return text;
    // A text with control characters has all bytes but printable ASCII and line breaks as printf's octal
    // digits.
    const bool obeyed = surface::printable(text) != text;
    std::string quoted = "'";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (obeyed && c != '\n' && (byte < 0x20 || byte >= 0x7f))
            quoted += fmt::format("'\"$(printf '\\{:03o}')\"'", byte);
        else
            quoted += c == '\'' ? "'\\''" : std::string(1, c);
    }
    return quoted + "'";
}

std::string digest(std::string_view text) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return fmt::format("{:016x}", hash);
}

CsvTable parse_csv(std::string_view text, const std::string& name, std::size_t most_rows) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        throw FileError("{}: is UTF-16: save it as \"CSV UTF-8\"", name);
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
    CsvTable table{.file = name};
    Style style;
    std::size_t line = 0;
    const auto refuse = [&](const std::string& rule) { throw FileError("{}:{}: {}", name, line, rule); };
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        const std::string row = plain(text.substr(0, std::min(end, text.substr(0, end).find('#'))));
        text.remove_prefix(std::min(text.size(), end + (text.substr(end).starts_with("\r\n") ? 2 : 1)));
        ++line;
        if (row.find_first_not_of(" \t,;\"") == std::string::npos) continue;
        if (style.delimiter == 0 && (style.delimiter = delimiter_in(row)) != 0) continue;
        if (style.delimiter == 0)
            for (const char c : {' ', ',', '\t', ';'})
                if (c == ' ' || row.find(c) != std::string::npos) style.delimiter = c;
        const std::vector<std::string> fields = fields_of(row, style.delimiter);
        if (table.columns.empty()) {
            if (fields.size() > kMostColumns) refuse(fmt::format("over {} columns", kMostColumns));
            table.headed = std::none_of(fields.begin(), fields.end(), begins_as_number);
            for (std::size_t k = 0; k < fields.size(); ++k)
                table.columns.push_back(table.headed ? column_of(fields[k])
                                                     : CsvColumn{.name = fmt::format("column {}", k + 1)});
            if (table.headed) continue;
        }
        if (fields.size() != table.columns.size())
            refuse(fmt::format("{} values in a table of {} columns", fields.size(), table.columns.size()));
        if (table.columns[0].values.size() == most_rows) refuse(fmt::format("over {} rows", most_rows));
        for (std::size_t k = 0; k < fields.size(); ++k) {
            CsvColumn& column = table.columns[k];
            const auto value = number(fields[k], style);
            column.values.push_back(value.value_or(0.0));
            if (value || !column.fault.empty()) continue;
            column.fault = fmt::format("{}:{}: \"{}\" in {} is not a finite number", name, line,
                                       surface::printable(fields[k].substr(0, kQuoted)),
                                       surface::printable(column.name));
            if (!table.headed) throw FileError(column.fault);
        }
    }
    if (table.columns.empty() || table.columns[0].values.empty())
        throw FileError("{}: holds no row of numbers", name);
    if (style.points && style.commas)
        throw FileError("{}: has decimal points and decimal commas: write all numbers with points", name);
    table.understood = reading_note(table, style);
    return table;
}

CsvTable read_csv(const std::filesystem::path& path, std::size_t most_rows) {
    std::error_code failure;
    if (std::filesystem::file_size(path, failure) > kMostBytes && !failure)
        throw FileError("{}: larger than {} MB: give fewer rows", path.string(), kMostBytes / 1'000'000);
    return parse_csv(surface::read_whole_file(path), path.string(), most_rows);
}

const std::vector<double>& numbers_of(const CsvColumn& column) {
    if (!column.fault.empty()) throw FileError(column.fault);
    return column.values;
}

std::optional<std::size_t> TextTable::column(std::string_view name) const {
    for (std::size_t k = 0; k < names.size(); ++k)
        if (name_and_unit(names[k]).first == name) return k;
    return std::nullopt;
}

TextTable read_text_table(const std::filesystem::path& path) {
    std::vector<std::vector<std::string>> rows = csv_rows(surface::read_whole_file(path));
    TextTable table{.names = rows.front()};
    rows.pop_back();  // what follows the last line break: nothing, or a row cut off
    for (std::size_t r = 1; r < rows.size(); ++r) {
        if (rows[r].size() != table.names.size())
            throw FileError("{}: row {} has {} values under {} names: it is damaged", path.string(), r,
                            rows[r].size(), table.names.size());
        table.rows.push_back(std::move(rows[r]));
    }
    return table;
}

std::pair<std::string, std::string> name_and_unit(const std::string& heading) {
    const std::size_t open = heading.rfind(" [");
    if (open == std::string::npos || heading.back() != ']') return {heading, ""};
    return {heading.substr(0, open), heading.substr(open + 2, heading.size() - open - 3)};
}

}  // namespace sidewall::app
