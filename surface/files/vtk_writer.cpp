#include "surface/files/vtk_writer.hpp"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <utility>

#include "surface/files/mesh_bytes.hpp"

namespace sidewall::surface {
namespace {

std::string deflate_block(std::string_view block) {
    uLongf size = compressBound(static_cast<uLong>(block.size()));
    std::string out(size, '\0');
    const int code =
        compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(block.data()),
                  static_cast<uLong>(block.size()), 5);
    if (code != Z_OK) throw IoError("cannot compress a mesh: out of memory");
    out.resize(size);
    return out;
}

constexpr std::size_t kVtkBlock = 1 << 18;

// Bytes of arrays that are collected to be compressed in parallel.
constexpr std::size_t kMostWaiting = 1 << 23;

}  // namespace

std::string xml_escape(std::string_view text) {
    std::string result;
    for (const char c : text)
        if (c == '&' || c == '<' || c == '>' || c == '"')
            result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : "&quot;";
        else
            result += c;
    return result;
}

VtkWriter::VtkWriter(std::string type)
    : xml(fmt::format(
          "<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"LittleEndian\" "
          "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n  <{0}>\n",
          type)),
      type_(std::move(type)) {}

void VtkWriter::array(const char* type, std::string_view name, int components, std::string bytes) {
    fmt::format_to(std::back_inserter(xml),
                   "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
                   "offset=\"",
                   type, xml_escape(name), components);
    heads_.push_back(std::exchange(xml, "\"/>\n"));
    waiting_bytes_ += bytes.size();
    waiting_.push_back(std::move(bytes));
    if (waiting_bytes_ > kMostWaiting) compress();
}

// The layout of vtkZLibDataCompressor: block count, block size, last block's size if partial, compressed
// sizes, then the blocks.
void VtkWriter::compress() {
    std::vector<std::string_view> raw;  // blocks of all arrays
    for (const std::string_view bytes : waiting_)
        for (std::size_t at = 0; at < bytes.size(); at += kVtkBlock)
            raw.push_back(bytes.substr(at, kVtkBlock));
    std::vector<std::string> blocks(raw.size());
    tbb::parallel_for(std::size_t{0}, raw.size(), [&](std::size_t n) { blocks[n] = deflate_block(raw[n]); });
    auto first = blocks.begin();
    for (const std::string& bytes : waiting_) {
        const auto end = first + static_cast<std::ptrdiff_t>((bytes.size() + kVtkBlock - 1) / kVtkBlock);
        offsets_.push_back(appended_.size());
        append_value<std::uint64_t>(appended_, static_cast<std::uint64_t>(end - first));
        append_value<std::uint64_t>(appended_, kVtkBlock);
        append_value<std::uint64_t>(appended_, bytes.size() % kVtkBlock);
        for (auto block = first; block != end; ++block) append_value<std::uint64_t>(appended_, block->size());
        for (; first != end; ++first) appended_ += *first;
    }
    waiting_.clear();
    waiting_bytes_ = 0;
}

void VtkWriter::attributes(const char* element, const std::vector<Attribute>& attributes) {
    xml += fmt::format("      <{}>\n", element);
    for (const Attribute& attribute : attributes) {
        std::string bytes;
        bytes.reserve(8 * attribute.values.size());
        for (const double value : attribute.values) append_scalar(bytes, attribute.type, value);
        const char* type = attribute.type == Scalar::float32   ? "Float32"
                           : attribute.type == Scalar::float64 ? "Float64"
                                                               : "Int32";
        array(type, attribute.name, attribute.components, std::move(bytes));
    }
    xml += fmt::format("      </{}>\n", element);
}

void VtkWriter::field_data(const MeshMetadata& metadata) {
    if (metadata.texts.empty() && metadata.numbers.empty()) return;
    xml += "    <FieldData>\n";
    for (const auto& [name, text] : metadata.texts) {
        // VTK stores strings as the codes of their characters, each string ended by a zero.
        xml += fmt::format(
            "      <DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">",
            xml_escape(name), 1 + std::count(text.begin(), text.end(), '\0'));
        for (const char c : text) xml += fmt::format("{} ", static_cast<unsigned char>(c));
        xml += "0</DataArray>\n";
    }
    for (const auto& [name, number] : metadata.numbers)
        xml += fmt::format(
            "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" "
            "format=\"ascii\">{}</DataArray>\n",
            xml_escape(name), number);
    xml += "    </FieldData>\n";
}

void VtkWriter::points(const std::vector<Vec3>& vertices) {
    std::string bytes;
    bytes.reserve(24 * vertices.size());
    for (const Vec3& p : vertices)
        for (int k = 0; k < 3; ++k) append_value(bytes, p[k]);
    xml += "      <Points>\n";
    array("Float64", "Points", 3, std::move(bytes));
    xml += "      </Points>\n";
}

std::string VtkWriter::file() {
    compress();
    std::string file;
    for (std::size_t n = 0; n < heads_.size(); ++n) file += heads_[n] + std::to_string(offsets_[n]);
    file += fmt::format("{}    </Piece>\n  </{}>\n  <AppendedData encoding=\"raw\">\n   _", xml, type_);
    file += appended_;
    return file += "\n  </AppendedData>\n</VTKFile>\n";
}

}  // namespace sidewall::surface
