#include "app/common/files.hpp"

#include <fmt/format.h>

#include "surface/error.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {

void write_file(const std::filesystem::path& path, std::string_view text) {
    surface::write_whole_file(path, text);
}

void make_folder(const std::filesystem::path& folder, std::string_view advice) {
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure)
        throw IoError(
            fmt::format("{}: cannot make the folder: {}; {}", folder.string(), failure.message(), advice));
}

void refuse_link(const std::filesystem::path& folder) {
    std::error_code failure;
    if (std::filesystem::is_symlink(folder, failure))
        throw IoError(
            fmt::format("{}: is a link, where a folder of the program's own belongs: remove it, or choose "
                        "another folder with -o",
                        folder.string()));
}

bool is_there(const std::filesystem::path& path) {
    std::error_code failure;
    return std::filesystem::exists(path, failure);
}

}  // namespace sidewall::app
