#include "surface/files/file.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>

#include "surface/error.hpp"

namespace sidewall::surface {

std::string read_whole_file(const std::filesystem::path& path) {
    std::error_code failure;
    const auto status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status))
        throw FileError(fmt::format("{}: no such file: check the path", path.string()));
    if (std::filesystem::is_directory(status))
        throw FileError(fmt::format("{}: is a folder: name a file in it", path.string()));
    if (!std::filesystem::is_regular_file(status))  // a pipe would keep the program waiting
        throw FileError(
            fmt::format("{}: is a pipe, a socket or a device: name a regular file", path.string()));
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in && errno == ENOMEM) throw std::bad_alloc();
    std::string bytes;
    bytes.reserve(std::filesystem::file_size(path, failure));
    char block[1 << 16];
    while (in.read(block, sizeof block) || in.gcount() > 0)
        bytes.append(block, static_cast<std::size_t>(in.gcount()));
    if (!in.eof())
        throw FileError(fmt::format("{}: cannot read: {}; check its permissions", path.string(),
                                    errno ? std::strerror(errno) : "read error"));
    return bytes;
}

std::string lower_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

}  // namespace sidewall::surface
