#include "app/common/csv.hpp"

#include <fmt/format.h>

#include <fstream>

#include "app/common/text.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
CsvColumns read_csv(const std::filesystem::path& path, std::size_t most_rows) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw FileError(fmt::format("{}: cannot be read", path.string()));
    in.exceptions(std::ios::badbit);  // want of memory is no end of the file
    CsvColumns table;
    std::size_t number = 0;
    const auto refuse = [&](const std::string& rule) {
        throw FileError(fmt::format("{}:{}: {}", path.string(), number, rule));
    };
    for (std::string line; std::getline(in, line);) {
        ++number;
        if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // a byte order mark
        line = std::string(trimmed(line));
        if (line.empty() || line[0] == '#') continue;
        const std::vector<std::string> parts = split(line, ',');
        if (table.names.empty()) {
            for (const std::string& part : parts) table.names.emplace_back(trimmed(part));
            table.columns.resize(table.names.size());
            continue;
        }
        if (parts.size() != table.names.size())
            refuse(fmt::format("{} values under {} names", parts.size(), table.names.size()));
        if (table.columns[0].size() == most_rows) refuse(fmt::format("over {} rows", most_rows));
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const std::string_view part = trimmed(parts[k]);
            const auto value = finite_number(part.substr(part.starts_with('+') ? 1 : 0));
            if (!value)
                refuse(fmt::format("\"{}\" under {} is not a finite number", part.substr(0, 40),
                                   table.names[k]));
            table.columns[k].push_back(*value);
        }
    }
    if (table.names.empty() || table.columns[0].empty())
        throw FileError(fmt::format("{}: needs a line of names and rows of numbers", path.string()));
    return table;
}

}  // namespace sidewall::app
