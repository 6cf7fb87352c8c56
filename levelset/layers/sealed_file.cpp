#include "levelset/layers/sealed_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "surface/error.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::levelset {
namespace {

// What follows the content, in this order; the processor's bytes are those of the file, little endian first.
struct Seal {
    std::array<char, 8> magic{'s', 'i', 'd', 'e', 'w', 'a', 'l', 'l'};
    std::uint64_t content = 0;
    std::uint32_t version = 0, checksum = 0, own = 0;
};
constexpr std::size_t kSealed = offsetof(Seal, own), kSealSize = kSealed + sizeof(Seal::own);
static_assert(std::endian::native == std::endian::little && kSealSize == 28);

std::uint32_t checksum_of(std::string_view bytes, std::uint32_t before = 0) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t checksum_of(const Seal& seal) {
    return checksum_of({reinterpret_cast<const char*>(&seal), kSealed});
}

}  // namespace

void write_sealed_file(const std::filesystem::path& path, std::uint32_t version,
                       const std::function<void(std::ostream& out)>& write) {
    surface::write_file(path, write, [version](std::uint64_t size, std::uint32_t checksum) {
        Seal seal{.content = size, .version = version, .checksum = checksum};
        seal.own = checksum_of(seal);
        return std::string(reinterpret_cast<const char*>(&seal), kSealSize);
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

    Seal seal;
    in.seekg(static_cast<std::streamoff>(size - kSealSize));
    if (!in.read(reinterpret_cast<char*>(&seal), kSealSize))
        throw FileError("it cannot be read: check the disk");
    if (seal.magic != Seal{}.magic)
        throw FileError(
            "it is cut short, or older than this version, whose files of this kind end with a checksum");
    if (seal.own != checksum_of(seal) || seal.content != size - kSealSize)
        throw FileError("it is damaged: its length or its checksum is not what was written");
    if (seal.version != version)
        throw FileError("it is of format version {} and this program reads version {}", seal.version,
                        version);

    in.seekg(0);
    std::vector<char> block(std::size_t{1} << 18);
    std::uint32_t sum = 0;
    for (std::uint64_t left = seal.content; left > 0;) {
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size()));
        if (!in.read(block.data(), static_cast<std::streamsize>(count)))
            throw FileError("it cannot be read: check the disk");
        sum = checksum_of({block.data(), count}, sum);
        left -= count;
    }
    if (sum != seal.checksum) throw FileError("it is damaged: its bytes do not fit their checksum");
    in.seekg(0);
    return in;
}

}  // namespace sidewall::levelset
