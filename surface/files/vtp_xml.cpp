#include "surface/files/vtp_xml.hpp"

#include <expat.h>

#include <charconv>
#include <memory>

namespace sidewall::surface::vtp {
namespace {

constexpr std::pair<std::string_view, Section> kSectionNames[] = {
    {"FieldData", kFieldData}, {"PointData", kPointData}, {"CellData", kCellData}, {"Points", kPoints},
    {"Verts", kVerts},         {"Lines", kLines},         {"Strips", kStrips},     {"Polys", kPolys}};

/// What the expat callbacks share. They note a problem instead of throwing: expat is C.
struct Scanner {
    Document document;
    XML_Parser parser = nullptr;
    std::string problem;
    Section section = kNone;
    DataArray* open_array = nullptr;
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
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc{} || end != text.data() + text.size())
        s.fail(fmt::format("{} = '{}': must be a whole number", name, text));
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
        // What follows may be raw bytes, which are no XML.
        XML_StopParser(s.parser, XML_FALSE);
    }
    for (const auto& [section_name, section] : kSectionNames)
        if (name == section_name) s.section = section;
}

void XMLCALL on_end(void* user, const char* element) {
    Scanner& s = *static_cast<Scanner*>(user);
    const std::string_view name = element;
    if (name == "DataArray" || name == "Array") s.open_array = nullptr;
    for (const auto& [section_name, section] : kSectionNames)
        if (name == section_name) s.section = kNone;
}

void XMLCALL on_text(void* user, const char* text, int length) {
    Scanner& s = *static_cast<Scanner*>(user);
    if (s.open_array) s.open_array->text.append(text, static_cast<std::size_t>(length));
}

}  // namespace

Document read_document(std::string_view bytes, const std::string& name) {
    Scanner s;
    s.document.name = name;
    s.document.budget = MemoryBudget(name, bytes.size());
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr),
                                                                              &XML_ParserFree);
    if (!parser) throw FileError(fmt::format("{}: cannot be parsed: out of memory", name));
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
        if (!s.problem.empty()) throw FileError(fmt::format("{}:{}: {}", name, line, s.problem));
        if (s.appended_at >= 0) break;
        throw FileError(fmt::format("{}:{}: is no well-formed VTP file: {}; export the surface again", name,
                                    line, XML_ErrorString(XML_GetErrorCode(s.parser))));
    }
    if (s.appended_at >= 0) {
        const std::size_t underscore =
            bytes.find('_', bytes.find('>', static_cast<std::size_t>(s.appended_at)));
        if (underscore == std::string_view::npos)
            throw FileError(fmt::format("{}: ends before its appended data: export the surface again", name));
        s.document.appended = bytes.substr(underscore + 1);
    }
    return std::move(s.document);
}

}  // namespace sidewall::surface::vtp
