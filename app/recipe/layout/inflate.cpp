#include "app/recipe/layout/inflate.hpp"

#include <zlib.h>

#include <array>

namespace sidewall::app {

std::optional<std::string> inflated(std::string_view packed, Packing packing, std::size_t most) {
    z_stream stream{};
    // zlib's words for bare data and for gzip's.
    if (inflateInit2(&stream, packing == Packing::gzip ? 16 + MAX_WBITS : -MAX_WBITS) != Z_OK) return {};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());  // files are below 1 GB
    std::string bytes;
    std::array<char, 65536> buffer{};
    int code = Z_OK;
    while (code == Z_OK && bytes.size() <= most) {
        stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
        stream.avail_out = static_cast<uInt>(buffer.size());
        code = inflate(&stream, Z_NO_FLUSH);
        bytes.append(buffer.data(), buffer.size() - stream.avail_out);
        // A gzip file may have several members.
        const bool another = packing == Packing::gzip && code == Z_STREAM_END && stream.avail_in > 2 &&
                             stream.next_in[0] == 0x1f && stream.next_in[1] == 0x8b;
        if (another) code = inflateReset(&stream);
    }
    inflateEnd(&stream);
    if (code != Z_STREAM_END || bytes.size() > most) return {};
    return bytes;
}

}  // namespace sidewall::app
