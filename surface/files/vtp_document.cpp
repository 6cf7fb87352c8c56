#include "surface/files/vtp_document.hpp"

#include <expat.h>
#include <zlib.h>

#include <cctype>
#include <memory>

namespace sidewall::surface::vtp {
namespace {

constexpr std::pair<std::string_view, Section> kSectionNames[] = {
    {"FieldData", kFieldData}, {"PointData", kPointData}, {"CellData", kCellData}, {"Points", kPoints},
    {"Verts", kVerts},         {"Lines", kLines},         {"Strips", kStrips},     {"Polys", kPolys}};

/// State shared by the expat callbacks, which record a problem instead of throwing, as expat is C.
struct Scanner {
    Document document;
    XML_Parser parser = nullptr;
    std::string problem;
    Section section = kNone;
    DataArray* open_array = nullptr;
    int inside_array = 0;  // elements open within it, such as VTK's InformationKey
    bool root_seen = false;
    long long appended_at = -1;

    void fail(std::string what) {
        if (problem.empty()) problem = std::move(what);
        XML_StopParser(parser, XML_FALSE);
    }
};

std::string_view attribute(const char** attributes, std::string_view name) {
    for (; *attributes; attributes += 2)
        if (attributes[0] == name) return attributes[1];
    return {};
}

std::uint64_t number(Scanner& s, const char** attributes, std::string_view name, std::uint64_t otherwise) {
    const std::string_view text = attribute(attributes, name);
    if (text.empty()) return otherwise;
    std::uint64_t value = 0;
    if (!read_number(text, value)) s.fail(fmt::format("{} = '{}': must be a whole number", name, text));
    return value;
}

void start_root(Scanner& s, const char** attributes) {
    Document& d = s.document;
    s.root_seen = true;
    const std::string_view type = attribute(attributes, "type"),
                           compressor = attribute(attributes, "compressor");
    if (type != "PolyData")
        return s.fail(fmt::format("holds {}: must be PolyData; extract the surface in ParaView", type));
    d.big_endian = attribute(attributes, "byte_order") == "BigEndian";
    d.header_size = attribute(attributes, "header_type") == "UInt64" ? 8 : 4;
    d.compressed = !compressor.empty();
    if (d.compressed && compressor != "vtkZLibDataCompressor")
        s.fail(fmt::format("is compressed by {}: save it with zlib or uncompressed", compressor));
}

void start_array(Scanner& s, const char** attributes) {
    if (s.section == kNone || s.open_array) return;
    if (s.section != kFieldData && s.document.pieces.empty())
        return s.fail("has a DataArray outside any Piece");
    auto& arrays =
        s.section == kFieldData ? s.document.field_data : s.document.pieces.back().arrays[s.section];
    DataArray array;
    array.name = attribute(attributes, "Name");
    array.type = attribute(attributes, "type");
    array.format = attribute(attributes, "format");
    array.components = number(s, attributes, "NumberOfComponents", 1);
    array.tuples = number(s, attributes, "NumberOfTuples", 1);
    array.offset = number(s, attributes, "offset", 0);
    if (array.components < 1 || array.components > 64)
        return s.fail(fmt::format("array '{}': NumberOfComponents must be 1 to 64", array.name));
    s.open_array = &arrays.emplace_back(std::move(array));
}

void XMLCALL on_start(void* user, const char* element, const char** attributes) {
    Scanner& s = *static_cast<Scanner*>(user);
    if (!s.problem.empty()) return;
    const std::string_view name = element;
    s.inside_array += s.open_array != nullptr;
    if (!s.root_seen) {
        if (name != "VTKFile") return s.fail("is no VTK XML file: export the surface as VTP");
        return start_root(s, attributes);
    }
    if (name == "Piece") {
        Piece piece;
        piece.points = number(s, attributes, "NumberOfPoints", 0);
        piece.verts = number(s, attributes, "NumberOfVerts", 0);
        piece.lines = number(s, attributes, "NumberOfLines", 0);
        piece.strips = number(s, attributes, "NumberOfStrips", 0);
        piece.polys = number(s, attributes, "NumberOfPolys", 0);
        s.document.pieces.push_back(std::move(piece));
    } else if (name == "DataArray" || name == "Array") {
        start_array(s, attributes);
    } else if (name == "AppendedData") {
        s.document.appended_base64 = attribute(attributes, "encoding") == "base64";
        s.appended_at = XML_GetCurrentByteIndex(s.parser);
        // Appended data may be raw bytes, which are no XML: stop parsing here.
        XML_StopParser(s.parser, XML_FALSE);
    }
    for (const auto& [section_name, section] : kSectionNames)
        if (name == section_name) s.section = section;
}

void XMLCALL on_end(void* user, const char* element) {
    Scanner& s = *static_cast<Scanner*>(user);
    const std::string_view name = element;
    if (s.inside_array > 0)
        --s.inside_array;
    else if (name == "DataArray" || name == "Array")
        s.open_array = nullptr;
    for (const auto& [section_name, section] : kSectionNames)
        if (name == section_name) s.section = kNone;
}

void XMLCALL on_text(void* user, const char* text, int length) {
    Scanner& s = *static_cast<Scanner*>(user);
    if (s.open_array && s.inside_array == 0)
        s.open_array->text.append(text, static_cast<std::size_t>(length));
}

/// Reads the bytes of one array, raw or from base64 text; several base64 streams may follow one another.
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

    /// Decodes four characters, skipping white space, to three bytes, or fewer where padded.
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

/// Decodes one array; messages name the file and the array.
struct Decoder {
    const Document& document;
    const DataArray& array;

    [[noreturn]] void fail(std::string_view what) const {
        throw FileError("{}: array '{}' {}: the file is damaged; export the surface again", document.name,
                        array.name, what);
    }

    std::uint64_t header_word(const char* bytes) const {
        return document.header_size == 8 ? load<std::uint64_t>(bytes, document.big_endian)
                                         : load<std::uint32_t>(bytes, document.big_endian);
    }

    std::vector<double> ascii(std::uint64_t count) const {
        if (count > array.text.size()) fail(fmt::format("has fewer than {} values", count));
        std::vector<double> values;
        values.reserve(count);
        std::string_view rest = array.text;
        for (skip_space(rest); !rest.empty(); skip_space(rest)) {
            const auto value = next_number(rest);
            if (!value) fail(fmt::format("has '{}' for value {}", excerpt(rest), values.size()));
            values.push_back(*value);
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
        // zlib inflates at most 1032-fold: larger claims are refused before memory is allocated for them.
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

Document read_document(std::string_view bytes, const std::string& name) {
    Scanner s;
    s.document.name = name;
    s.document.budget = MemoryBudget(name, bytes.size());
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr),
                                                                              &XML_ParserFree);
    if (!parser) throw FileError("{}: cannot be parsed: out of memory", name);
    s.parser = parser.get();
    XML_SetUserData(s.parser, &s);
    XML_SetElementHandler(s.parser, on_start, on_end);
    XML_SetCharacterDataHandler(s.parser, on_text);
    constexpr std::size_t kChunk = 1 << 20;
    for (std::size_t at = 0; at == 0 || at < bytes.size(); at += kChunk) {
        const std::string_view chunk = bytes.substr(at, kChunk);
        const bool last = at + kChunk >= bytes.size();
        if (XML_Parse(s.parser, chunk.data(), static_cast<int>(chunk.size()), last) == XML_STATUS_OK)
            continue;
        const auto line = XML_GetCurrentLineNumber(s.parser);
        if (!s.problem.empty()) throw FileError("{}:{}: {}", name, line, s.problem);
        if (s.appended_at >= 0) break;
        throw FileError("{}:{}: is no well-formed VTP file: {}; export the surface again", name, line,
                        XML_ErrorString(XML_GetErrorCode(s.parser)));
    }
    if (s.appended_at >= 0) {
        const std::size_t underscore =
            bytes.find('_', bytes.find('>', static_cast<std::size_t>(s.appended_at)));
        if (underscore == std::string_view::npos)
            throw FileError("{}: ends before its appended data: export the surface again", name);
        s.document.appended = bytes.substr(underscore + 1);
    }
    return std::move(s.document);
}

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
    // No file holds that many values; the limit keeps the products below from overflowing.
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
