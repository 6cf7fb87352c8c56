#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace sidewall::app {

/// Numbers in named columns.
struct CsvColumns {
    std::vector<std::string> names;
    std::vector<std::vector<double>> columns;  ///< as many as names, all of the same length
};

/// Reads a line of names and lines of finite numbers, between commas. Empty lines and those that begin with # are left
/// out.
/// \throws FileError naming file and line, for what is not that, has no row or has over \p most_rows.
CsvColumns read_csv(const std::filesystem::path& path, std::size_t most_rows = 1'000'000);

}  // namespace sidewall::app
