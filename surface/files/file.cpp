#include "surface/files/file.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>

#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

// Length in bytes of the printable UTF-8 character at the start of the text; 0 if there is none.
std::size_t character_length(std::string_view text) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
    const unsigned char first = byte(0);
    if (first < 0x80) return (first >= 0x20 && first != 0x7f) || first == '\n' || first == '\t' ? 1 : 0;
    const std::size_t length = first >> 5 == 6 ? 2 : first >> 4 == 14 ? 3 : first >> 3 == 30 ? 4 : 0;
    if (length == 0 || length > text.size()) return 0;
    char32_t code = first & (0xffu >> (length + 1));
    for (std::size_t k = 1; k < length; ++k) {
        if (byte(k) >> 6 != 2) return 0;
        code = code << 6 | (byte(k) & 0x3fu);
    }
    constexpr char32_t kLeast[] = {0, 0, 0xa0, 0x800, 0x10000};  // lower codes: controls, overlong forms
    const bool surrogate = code >= 0xd800 && code < 0xe000;
    return code >= kLeast[length] && code <= 0x10ffff && !surrogate ? length : 0;
}

}  // namespace

std::string read_whole_file(const std::filesystem::path& path) {
    std::error_code failure;
    const auto status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status)) throw FileError("{}: no such file: check the path", path.string());
    if (std::filesystem::is_directory(status))
        throw FileError("{}: is a folder: name a file in it", path.string());
    if (!std::filesystem::is_regular_file(status))  // a pipe would keep the program waiting
        throw FileError("{}: is a pipe, a socket or a device: name a regular file", path.string());
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in && errno == ENOMEM) throw std::bad_alloc();
    std::string bytes;
    bytes.reserve(std::filesystem::file_size(path, failure));
    char block[1 << 16];
    while (in.read(block, sizeof block) || in.gcount() > 0)
        bytes.append(block, static_cast<std::size_t>(in.gcount()));
    if (!in.eof())
        throw FileError("{}: cannot read: {}; check its permissions", path.string(),
                        errno ? std::strerror(errno) : "read error");
    return bytes;
}

std::string lower_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

std::string printable(std::string_view text, bool one_line) {
    std::string result;
    while (!text.empty()) {
        const bool blank = text[0] == '\n' || text[0] == '\t';
        const std::size_t length = one_line && blank ? 0 : character_length(text);
        if (length == 0) result += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
        result += text.substr(0, length);
        text.remove_prefix(length == 0 ? 1 : length);
    }
    return result;
}

}  // namespace sidewall::surface
