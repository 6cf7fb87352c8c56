#include "levelset/layers/sealed_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "surface/error.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::levelset {
namespace {

constexpr std::string_view kMagic = "sidewall";
constexpr std::size_t kSealSize = 28;

template <class T>
void append(std::string& bytes, T number) {
    for (std::size_t k = 0; k < sizeof(T); ++k) bytes += static_cast<char>(number >> (8 * k) & 0xff);
}

template <class T>
T number_at(std::string_view bytes, std::size_t place) {
    T number = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k)
        number |= T{static_cast<unsigned char>(bytes[place + k])} << (8 * k);
    return number;
}

std::uint32_t checksum_of(std::string_view bytes, std::uint32_t before = 0) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

void write_sealed_file(const std::filesystem::path& path, std::uint32_t version,
                       const std::function<void(std::ostream& out)>& write) {
    surface::write_file(path, write, [version](std::uint64_t size, std::uint32_t checksum) {
        std::string seal(kMagic);
        append(seal, size);
        append(seal, version);
        append(seal, checksum);
        append(seal, checksum_of(seal));
        return seal;
    });
}

std::ifstream open_sealed_file(const std::filesystem::path& path, std::uint32_t version) {
    std::error_code failure;
    const auto status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status)) throw FileError("there is no such file");
    if (!std::filesystem::is_regular_file(status)) throw FileError("it is not a file");
    std::ifstream in(path, std::ios::binary);
    const std::streamoff end = in.seekg(0, std::ios::end).tellg();
    if (!in || end < 0) throw FileError("it cannot be read: check its permissions");
    const auto size = static_cast<std::uint64_t>(end);
    if (size < kSealSize) throw FileError("it is cut short");

    std::string seal(kSealSize, '\0');
    in.seekg(static_cast<std::streamoff>(size - kSealSize));
    if (!in.read(seal.data(), kSealSize)) throw FileError("it cannot be read: check the disk");
    if (!seal.starts_with(kMagic))
        throw FileError(
            "it is cut short, or older than this version, whose files of this kind end with a checksum");
    const auto content = number_at<std::uint64_t>(seal, 8);
    const auto written_by = number_at<std::uint32_t>(seal, 16), checksum = number_at<std::uint32_t>(seal, 20);
    if (number_at<std::uint32_t>(seal, 24) != checksum_of(std::string_view(seal).substr(0, 24)) ||
        content != size - kSealSize)
        throw FileError("it is damaged: its length or its checksum is not what was written");
    if (written_by != version)
        throw FileError(
            fmt::format("it is of format version {} and this program reads version {}", written_by, version));

    in.seekg(0);
    std::vector<char> block(std::size_t{1} << 18);
    std::uint32_t sum = 0;
    for (std::uint64_t left = content; left > 0;) {
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size()));
        if (!in.read(block.data(), static_cast<std::streamsize>(count)))
            throw FileError("it cannot be read: check the disk");
        sum = checksum_of({block.data(), count}, sum);
        left -= count;
    }
    if (sum != checksum) throw FileError("it is damaged: its bytes do not fit their checksum");
    in.seekg(0);
    return in;
}

}  // namespace sidewall::levelset
