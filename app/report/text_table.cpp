#include "app/report/text_table.hpp"

#include <fmt/format.h>

#include "app/common/text.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {

std::optional<std::size_t> TextTable::column(std::string_view name) const {
    for (std::size_t k = 0; k < names.size(); ++k)
        if (name_and_unit(names[k]).first == name) return k;
    return std::nullopt;
}

TextTable read_text_table(const std::filesystem::path& path) {
    std::vector<std::vector<std::string>> rows = csv_rows(surface::read_whole_file(path));
    TextTable table{.names = rows.front()};
    rows.pop_back();  // after the last line break: nothing, or half a row
    for (std::size_t r = 1; r < rows.size(); ++r) {
        if (rows[r].size() != table.names.size())
            throw FileError(fmt::format("{}: row {} has {} values under {} names: it is damaged",
                                        path.string(), r, rows[r].size(), table.names.size()));
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
