#include "surface/files/stl.hpp"

#include <boost/functional/hash.hpp>
#include <cctype>
#include <unordered_map>

#include "surface/files/mesh_bytes.hpp"

namespace sidewall::surface {
namespace {

constexpr std::size_t kHeader = 80, kFacet = 50;

/// Collects facets into a mesh; corners in the same place become one vertex.
class Soup {
  public:
    std::uint32_t add(const Vec3& p) {
        // Adding zero turns -0 into 0.
        const auto [at, fresh] = index_.try_emplace({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0},
                                                    static_cast<std::uint32_t>(mesh.vertices.size()));
        if (fresh) mesh.vertices.push_back(p);
        return at->second;
    }
    void add_facet(const std::array<Vec3, 3>& corners, double attribute) {
        const Triangle t{add(corners[0]), add(corners[1]), add(corners[2])};
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            ++collapsed;
            return;
        }
        mesh.triangles.push_back(t);
        attributes.push_back(attribute);
    }

    TriangleMesh mesh;
    std::vector<double> attributes;
    std::size_t collapsed = 0;

  private:
    using Place = std::array<double, 3>;
    std::unordered_map<Place, std::uint32_t, boost::hash<Place>> index_;
};

// Removes the first word of a line and returns it in lower case; "" if the line begins with no letter.
std::string next_keyword(std::string_view& line) {
    skip_space(line);
    std::string word;
    while (!line.empty() && std::isalpha(static_cast<unsigned char>(line.front()))) {
        word += static_cast<char>(std::tolower(static_cast<unsigned char>(line.front())));
        line.remove_prefix(1);
    }
    return word;
}

// The three numbers of a line after its keyword. Throws FileError for anything else.
Vec3 parse_point(std::string_view line, const std::string& where) {
    Vec3 p;
    for (int k = 0; k <= 3; ++k) {
        skip_space(line);
        if (k == 3 && line.empty()) break;
        const auto number = k < 3 ? next_number(line) : std::nullopt;
        if (!number)
            throw FileError("{}: '{}' instead of {}: export the surface again", where, excerpt(line),
                            k == 3 ? "the line's end" : "a number");
        p[k] = *number;
    }
    return p;
}

void read_ascii(std::string_view bytes, const std::string& name, Soup& soup) {
    std::array<Vec3, 3> corners;
    std::size_t corner = 0, line_number = 0;
    for (std::size_t at = 0; at < bytes.size();) {
        std::string_view line = next_line(bytes, at);
        ++line_number;
        std::string word = next_keyword(line);
        if (word == "end") word += next_keyword(line);
        const auto where = [&] { return fmt::format("{}:{}", name, line_number); };
        if (word == "vertex") {
            if (corner == 3)
                throw FileError(where() + ": a fourth corner of a facet: split it into triangles");
            corners[corner++] = parse_point(line, where());
        } else if (word == "facet") {
            corner = 0;
            if (next_keyword(line) == "normal") parse_point(line, where());
        } else if (word == "endfacet") {
            if (corner != 3)
                throw FileError("{}: facet of {} corners: export the surface again", where(), corner);
            soup.add_facet(corners, 0.0);
            corner = 0;
        } else if (!word.empty() && word != "solid" && word != "endsolid" && word != "outer" &&
                   word != "endloop") {
            throw FileError("{}: '{}' is no STL keyword: export the surface again", where(),
                            word.substr(0, 20));
        } else if (word.empty() && !line.empty()) {
            throw FileError(where() + ": no STL text: export the surface again");
        }
    }
    if (corner != 0) throw FileError("{}: ends within a facet: the file is cut off", name);
}

void read_binary(std::string_view bytes, std::uint64_t facets, Soup& soup) {
    for (std::uint64_t f = 0; f < facets; ++f) {
        const char* at = bytes.data() + kHeader + 4 + f * kFacet + 12;  // past the normal
        std::array<Vec3, 3> corners;
        for (auto& corner : corners)
            for (int k = 0; k < 3; ++k, at += 4) corner[k] = static_cast<double>(load<float>(at, false));
        soup.add_facet(corners, static_cast<double>(load<std::uint16_t>(at, false)));
    }
}

}  // namespace

TriangleMesh decode_stl(std::string_view bytes, const std::string& name, MeshMetadata* metadata) {
    Soup soup;
    // Binary files may begin with `solid`, too. They are recognised by a size that fits their count of
    // facets, or by a zero byte up to the end of that count, which no text has.
    std::uint64_t facets = 0;
    if (bytes.size() >= kHeader + 4) facets = load<std::uint32_t>(bytes.data() + kHeader, false);
    const std::uint64_t whole = kHeader + 4 + facets * kFacet;
    std::string_view text = without_mark(bytes, name), start = text.substr(0, kHeader);
    const bool solid =
        next_keyword(start) == "solid" && bytes.substr(0, kHeader + 4).find('\0') == bytes.npos;
    const bool trailed = bytes.size() > whole && facets > 0;  // some programs append a trailer
    if (bytes.size() == whole || (!solid && trailed)) {
        read_binary(bytes, facets, soup);
    } else if (solid) {
        read_ascii(text, name, soup);
    } else {
        throw FileError(
            "{}: {} bytes for {} facets of binary STL, and no ascii STL either: it is cut "
            "off or of another kind",
            name, bytes.size(), facets);
    }
    const bool tagged =
        std::any_of(soup.attributes.begin(), soup.attributes.end(), [](double a) { return a != 0.0; });
    if (tagged)
        soup.mesh.triangle_attributes.push_back({"attribute", 1, Scalar::int32, std::move(soup.attributes)});
    if (metadata && soup.collapsed > 0)
        metadata->dropped.push_back(fmt::format("{} facets with coinciding corners", soup.collapsed));
    check_read_mesh(soup.mesh, name);
    return std::move(soup.mesh);
}

std::string encode_stl(const TriangleMesh& mesh) {
    check_written_mesh(mesh);
    if (mesh.triangles.size() > 0xffffffffu)
        throw GeometryError("{} triangles are more than an STL file counts: write VTP",
                            mesh.triangles.size());
    std::string bytes(kHeader, '\0');
    constexpr std::string_view kTitle = "Sidewall";
    bytes.replace(0, kTitle.size(), kTitle);
    bytes.reserve(kHeader + 4 + kFacet * mesh.triangles.size());
    append_value(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
    const Attribute* attribute = mesh.triangle_attribute("attribute");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 area = area_vector(mesh, t), normal = area.isZero(0.0) ? area : Vec3(area.normalized());
        for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<float>(normal[k]));
        for (const std::uint32_t v : mesh.triangles[t])
            for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<float>(mesh.vertices[v][k]));
        const double value = attribute && attribute->components == 1 ? attribute->values[t] : 0.0;
        append_value(bytes, static_cast<std::uint16_t>(value >= 0.0 && value <= 65535.0 ? value : 0.0));
    }
    return bytes;
}

}  // namespace sidewall::surface
