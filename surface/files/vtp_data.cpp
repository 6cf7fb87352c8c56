#include <zlib.h>

#include <cctype>
#include <charconv>

#include "surface/files/vtp_xml.hpp"

namespace sidewall::surface::vtp {
namespace {

/// Bytes of one array, raw or from base64 text; several base64 streams may follow one another.
class ByteSource {
  public:
    ByteSource(std::string_view data, bool base64) : data_(data), base64_(base64) {}

    /// Upper bound of what read() can still deliver.
    std::size_t available() const {
        const std::size_t rest = data_.size() - at_;
        return base64_ ? carry_.size() + 3 * (rest / 4) : rest;
    }

    /// The next \p n bytes; false if there are not as many.
    bool read(std::size_t n, std::string& bytes) {
        if (n > available()) return false;
        if (!base64_) {
            bytes.assign(data_.substr(at_, n));
            at_ += n;
            return true;
        }
        while (carry_.size() < n)
            if (!decode_group()) return false;
        bytes.assign(carry_, 0, n);
        carry_.erase(0, n);
        return true;
    }

  private:
    static int digit(char c) {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        if (c == '+') return 62;
        return c == '/' ? 63 : -1;
    }

    /// Four characters, white space apart, to three bytes; fewer where padded.
    bool decode_group() {
        std::uint32_t bits = 0;
        int count = 0, padding = 0;
        while (count < 4) {
            if (at_ == data_.size()) return false;
            const char c = data_[at_++];
            if (std::isspace(static_cast<unsigned char>(c))) continue;
            const int value = c == '=' ? 0 : digit(c);
            if (value < 0 || (c != '=' && padding > 0)) return false;
            padding += c == '=';
            bits = bits << 6 | static_cast<std::uint32_t>(value);
            ++count;
        }
        if (padding > 2) return false;
        for (int k = 0; k < 3 - padding; ++k) carry_ += static_cast<char>(bits >> (16 - 8 * k) & 0xffu);
        return true;
    }

    std::string_view data_;
    bool base64_;
    std::size_t at_ = 0;
    std::string carry_;
};

/// One array being decoded: its file and name go into every message.
struct Decoder {
    const Document& document;
    const DataArray& array;

    [[noreturn]] void fail(std::string_view what) const {
        throw FileError(fmt::format("{}: array '{}' {}: the file is damaged; export the surface again",
                                    document.name, array.name, what));
    }

    std::uint64_t header_word(const char* bytes) const {
        return document.header_size == 8 ? load<std::uint64_t>(bytes, document.big_endian)
                                         : load<std::uint32_t>(bytes, document.big_endian);
    }

    std::vector<double> ascii(std::uint64_t count) const {
        if (count > array.text.size()) fail(fmt::format("has fewer than {} values", count));
        std::vector<double> values;
        values.reserve(count);
        const char *at = array.text.data(), *end = at + array.text.size();
        const auto skip_space = [&] {
            while (at != end && std::isspace(static_cast<unsigned char>(*at))) ++at;
        };
        for (skip_space(); at != end; skip_space()) {
            if (*at == '+') ++at;
            double value = 0.0;
            const auto [next, failure] = std::from_chars(at, end, value);
            if (failure == std::errc::invalid_argument)
                fail(fmt::format("has '{}' for value {}", std::string(at, std::min(end, at + 12)),
                                 values.size()));
            if (failure == std::errc::result_out_of_range) fail("has a value that is out of range");
            values.push_back(value);
            at = next;
        }
        if (values.size() != count) fail(fmt::format("has {} values, not {}", values.size(), count));
        return values;
    }

    std::string inflated(ByteSource& source, std::uint64_t expected) const {
        const std::size_t word = document.header_size;
        std::string header, sizes;
        if (!source.read(3 * word, header)) fail("is cut off");
        const std::uint64_t count = header_word(header.data()), block = header_word(header.data() + word),
                            last = header_word(header.data() + 2 * word);
        if (count > source.available() / word || !source.read(count * word, sizes)) fail("is cut off");
        // zlib inflates at most 1032-fold: a larger claim is refused before memory is taken for it.
        if (block > 0 && count > (expected + block - 1) / block + 1) fail("has a wrong number of blocks");
        if (expected / 1100 > source.available() + 64) fail("is cut off");
        if (last > block || (block == 0 && count > 0)) fail("has wrong block sizes");
        const auto block_size = [&](std::uint64_t i) { return i + 1 == count && last > 0 ? last : block; };
        if (block > 0 && (count == 0 ? 0 : (count - 1) * block + block_size(count - 1)) != expected)
            fail(fmt::format("is not {} bytes long", expected));
        std::string bytes(expected, '\0'), packed;
        std::size_t at = 0;
        for (std::uint64_t i = 0; i < count; ++i) {
            if (!source.read(header_word(sizes.data() + i * word), packed)) fail("is cut off");
            uLongf size = block_size(i);
            const int code = uncompress(reinterpret_cast<Bytef*>(bytes.data() + at), &size,
                                        reinterpret_cast<const Bytef*>(packed.data()), packed.size());
            if (code != Z_OK || size != block_size(i)) fail("does not decompress");
            at += size;
        }
        if (at != expected) fail(fmt::format("is not {} bytes long", expected));
        return bytes;
    }

    std::string binary(std::uint64_t expected) const {
        const bool appended = array.format == "appended";
        std::string_view data = array.text;
        if (appended) {
            if (array.offset >= document.appended.size()) fail("lies beyond the end of the file");
            data = document.appended.substr(array.offset);
        }
        ByteSource source(data, !appended || document.appended_base64);
        if (document.compressed) return inflated(source, expected);
        std::string header, bytes;
        if (!source.read(document.header_size, header)) fail("is cut off");
        if (header_word(header.data()) != expected)
            fail(fmt::format("is {} bytes long, not {}", header_word(header.data()), expected));
        if (!source.read(expected, bytes)) fail("is cut off");
        return bytes;
    }
};

}  // namespace

std::optional<FileScalar> scalar_type(std::string_view vtk_name) {
    constexpr std::string_view kNames[] = {"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                           "UInt32", "Int64", "UInt64", "Float32", "Float64"};
    for (std::size_t i = 0; i < std::size(kNames); ++i)
        if (kNames[i] == vtk_name) return static_cast<FileScalar>(i);
    if (vtk_name == "vtkIdType") return FileScalar::int64;
    return std::nullopt;
}

std::vector<double> read_values(const Document& document, const DataArray& array, std::uint64_t count) {
    const Decoder decoder{document, array};
    const auto type = scalar_type(array.type);
    if (!type) decoder.fail(fmt::format("has the type '{}', which is no number", array.type));
    if (count == 0) return {};
    // No file is that large; keeps the products below from overflowing.
    if (count > std::uint64_t{1} << 40) decoder.fail(fmt::format("should have {} values", count));
    if (array.format == "ascii") return decoder.ascii(count);
    document.budget.take_doubles(static_cast<double>(count));
    if (array.format != "binary" && array.format != "appended")
        decoder.fail(fmt::format("has the format '{}', not ascii, binary or appended", array.format));
    const std::size_t size = byte_size(*type);
    const std::string bytes = decoder.binary(count * size);
    std::vector<double> values(count);
    for (std::size_t i = 0; i < count; ++i)
        values[i] = load_scalar(bytes.data() + i * size, *type, document.big_endian);
    return values;
}

}  // namespace sidewall::surface::vtp
