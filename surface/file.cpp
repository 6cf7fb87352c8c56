#include "surface/file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "surface/error.hpp"

namespace sidewall::surface {

std::string read_whole_file(const std::filesystem::path& path) {
    std::error_code failure;
    const auto status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status))
        throw FileError(fmt::format("{}: no such file: check the path", path.string()));
    if (std::filesystem::is_directory(status))
        throw FileError(fmt::format("{}: is a folder: name a file in it", path.string()));
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    std::string bytes;
    if (std::filesystem::is_regular_file(status)) bytes.reserve(std::filesystem::file_size(path, failure));
    char block[1 << 16];
    while (in.read(block, sizeof block) || in.gcount() > 0)
        bytes.append(block, static_cast<std::size_t>(in.gcount()));
    if (!in.eof())
        throw FileError(fmt::format("{}: cannot read: {}; check its permissions", path.string(),
                                    errno ? std::strerror(errno) : "read error"));
    return bytes;
}

void write_through_partial(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path& partial)>& write) {
    std::filesystem::path partial = path;
    partial += ".partial";
    try {
        write(partial);
        std::filesystem::rename(partial, path);
    } catch (...) {
        std::error_code ignored;
        std::filesystem::remove(partial, ignored);
        throw;
    }
}

void write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
    const auto fail = [&](const std::string& reason) {
        return IoError(
            fmt::format("{}: cannot write: {}; check space and permissions", path.string(), reason));
    };
    std::error_code failure;
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), failure);
    if (failure) throw fail(failure.message());
    try {
        write_through_partial(path, [&](const std::filesystem::path& partial) {
            errno = 0;
            std::ofstream out(partial, std::ios::binary);
            out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
            out.close();
            if (!out) throw fail(errno ? std::strerror(errno) : "write error");
        });
    } catch (const std::filesystem::filesystem_error& error) {
        throw fail(error.code().message());
    }
}

}  // namespace sidewall::surface
