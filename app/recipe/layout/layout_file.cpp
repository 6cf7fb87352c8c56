#include "app/recipe/layout/layout_file.hpp"

#include <fmt/format.h>

#include "app/recipe/layout/gds.hpp"
#include "app/recipe/layout/inflate.hpp"
#include "app/recipe/layout/oasis.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostBytes = 1'000'000'000;

}  // namespace

Layout parse_layout(std::string_view bytes, const std::string& name) {
    if (bytes.starts_with("\x1f\x8b")) {
        const auto unpacked = inflated(bytes, Packing::gzip, kMostBytes);
        if (!unpacked)
            throw FileError(fmt::format("{}: its gzip data are damaged, or over {} bytes when unpacked", name,
                                        kMostBytes));
        return unpacked->starts_with("\x1f\x8b")
                   ? throw FileError(fmt::format("{}: is packed twice: unpack it once", name))
                   : parse_layout(*unpacked, name);
    }
    if (bytes.starts_with(kOasisMagic)) return parse_oasis(bytes, name);
    // A GDSII file begins with a header of six bytes.
    if (!bytes.starts_with(std::string_view("\0\6\0\2", 4)))
        throw FileError(
            fmt::format("{}: is neither GDSII nor OASIS, plain or in gzip; export one of these", name));
    return parse_gds(bytes, name);
}

Layout read_layout(const std::filesystem::path& path) {
    std::error_code failure;
    const std::uintmax_t size = std::filesystem::file_size(path, failure);
    if (failure) throw FileError(fmt::format("{}: cannot be read: {}", path.string(), failure.message()));
    if (size > kMostBytes)
        throw FileError(fmt::format("{}: larger than {} bytes", path.string(), kMostBytes));
    return parse_layout(surface::read_whole_file(path), path.string());
}

}  // namespace sidewall::app
