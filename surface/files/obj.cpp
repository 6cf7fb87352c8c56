#include "surface/files/obj.hpp"

#include <cctype>
#include <map>
#include <set>

#include "surface/files/mesh_bytes.hpp"
#include "surface/files/polygons.hpp"

namespace sidewall::surface {
namespace {

const std::string kMaterialPrefix = "material_";

/// Reads line by line: joins continued lines and removes comments.
class Lines {
  public:
    explicit Lines(std::string_view bytes) : bytes_(bytes) {}
    bool next(std::string& line) {
        if (at_ >= bytes_.size()) return false;
        line.clear();
        for (bool more = true; more && at_ < bytes_.size();) {
            line.append(next_line(bytes_, at_));
            ++number_;
            more = !line.empty() && line.back() == '\\';
            if (more) line.back() = ' ';
        }
        line.resize(std::min(line.find('#'), line.size()));
        return true;
    }
    std::size_t number() const { return number_; }

  private:
    std::string_view bytes_;
    std::size_t at_ = 0, number_ = 0;
};

std::string_view next_word(std::string_view& line) {
    skip_space(line);
    const std::string_view word = line.substr(0, line.find_first_of(" \t\n\v\f\r"));
    line.remove_prefix(word.size());
    return word;
}

bool parse_index(std::string_view word, std::int64_t& value) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    return read_number(word, value);
}

struct Reader {
    std::string name;
    TriangleMesh mesh;
    CellTriangles cells;
    std::vector<std::size_t> materials;  ///< per face: index into material_names
    std::vector<std::string> material_names{
        std::string()};  ///< in order of appearance; the first stands for faces without one
    std::map<std::string, std::size_t> material_numbers;  ///< by name: index into material_names
    std::map<std::string, std::size_t> dropped;           ///< count by type of statement
    std::size_t material = 0;
    Lines lines;

    Reader(std::string_view bytes, const std::string& n) : name(n), lines(bytes) {}

    [[noreturn]] void refuse(const std::string& what) const {
        throw FileError("{}:{}: {}: export the surface again", name, lines.number(), what);
    }

    // The numbers of a line, at least \p least of them.
    std::vector<double> numbers(std::string_view rest, std::size_t least) const {
        std::vector<double> all;
        for (skip_space(rest); !rest.empty() || all.size() < least; skip_space(rest)) {
            const auto number = next_number(rest);
            if (!number) refuse(fmt::format("'{}' instead of a coordinate", excerpt(next_word(rest))));
            all.push_back(*number);
        }
        return all;
    }

    void vertex(std::string_view rest) {
        const std::vector<double> p = numbers(rest, 3);
        if (p.size() > 4) ++dropped["vertex colours"];
        mesh.vertices.emplace_back(p[0], p[1], p[2]);
    }

    void face(std::string_view rest) {
        std::vector<std::uint32_t> polygon;
        for (auto word = next_word(rest); !word.empty(); word = next_word(rest)) {
            std::int64_t index = 0, other = 0;
            const std::size_t slash = std::min(word.find('/'), word.size());
            bool good = parse_index(word.substr(0, slash), index);
            for (std::size_t at = slash; at < word.size();) {  // texture and normal, may be empty
                const std::size_t next = std::min(word.find('/', at + 1), word.size());
                good &= next == at + 1 || parse_index(word.substr(at + 1, next - at - 1), other);
                at = next;
            }
            if (!good) refuse(fmt::format("'{}' instead of a vertex number", excerpt(word)));
            // Negative numbers count back from the last vertex so far.
            const auto count = static_cast<std::int64_t>(mesh.vertices.size());
            const std::int64_t vertex = index < 0 ? count + index : index - 1;
            if (index == 0 || vertex < 0 || vertex > 0xfffffffe)
                refuse(fmt::format("face names vertex {}", index));
            polygon.push_back(static_cast<std::uint32_t>(vertex));
        }
        if (polygon.size() < 3) refuse(fmt::format("face of {} vertices", polygon.size()));
        cells.add_polygon(polygon, static_cast<std::uint32_t>(materials.size()));
        materials.push_back(material);
    }

    void use_material(std::string_view rest) {
        skip_space(rest);
        const std::string of(rest.substr(0, rest.find_last_not_of(" \t\n\v\f\r") + 1));  // may hold blanks
        const auto [at, is_new] = material_numbers.emplace(of, material_names.size());
        if (is_new) material_names.push_back(of);
        material = at->second;
    }

    // Id of each material name: N for `material_N`, for others the lowest unused ids in order of appearance.
    std::vector<int> material_ids() const {
        std::vector<int> ids(material_names.size(), 0);
        std::set<int> taken;
        const auto is_numbered = [&](std::size_t m) {
            return material_names[m] == fmt::format("{}{}", kMaterialPrefix, ids[m]);
        };
        for (std::size_t m = 1; m < ids.size(); ++m) {
            const std::string& of = material_names[m];
            if (of.starts_with(kMaterialPrefix))
                read_number(std::string_view(of).substr(kMaterialPrefix.size()), ids[m]);
            if (is_numbered(m)) taken.insert(ids[m]);
        }
        const bool any_without = std::find(materials.begin(), materials.end(), 0u) != materials.end();
        int lowest = 0;
        for (std::size_t m = any_without ? 0 : 1; m < ids.size(); ++m) {
            if (is_numbered(m)) continue;
            while (!taken.insert(lowest).second) ++lowest;
            ids[m] = lowest;
        }
        return ids;
    }

    void read() {
        for (std::string line; lines.next(line);) {
            std::string_view rest = line;
            std::string key(next_word(rest));
            for (char& c : key) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
            if (key == "v")
                vertex(rest);
            else if (key == "f")
                face(rest);
            else if (key == "usemtl")
                use_material(rest);
            else if (key == "vn" || key == "vt") {
                numbers(rest, 1);
                ++dropped[key == "vn" ? "normals" : "texture coordinates"];
            } else if (key == "l" || key == "p" || key == "curv" || key == "surf")
                ++dropped["points, lines and free-form surfaces"];
            else if (!key.empty() && !std::isalpha(static_cast<unsigned char>(key.front())))
                refuse(fmt::format("'{}' is no OBJ statement", excerpt(key)));
        }
    }
};

}  // namespace

TriangleMesh decode_obj(std::string_view bytes, const std::string& name, MeshMetadata* metadata) {
    Reader reader(without_mark(bytes, name), name);
    reader.read();
    TriangleMesh& mesh = reader.mesh;
    triangulate_polygons(reader.cells, mesh.vertices, name);
    mesh.triangles = std::move(reader.cells.triangles);
    const std::vector<int> ids = reader.material_ids();
    if (ids.size() > 1) {
        Attribute material{"material", 1, Scalar::int32, {}};
        for (const std::uint32_t face : reader.cells.cell)
            material.values.push_back(ids[reader.materials[face]]);
        mesh.triangle_attributes.push_back(std::move(material));
    }
    if (metadata) {
        for (const auto& [what, count] : reader.dropped)
            metadata->dropped.push_back(fmt::format("{} {}", count, what));
        for (const auto& [material, number] : reader.material_numbers)
            if (const int id = ids[number]; material != fmt::format("{}{}", kMaterialPrefix, id))
                metadata->dropped.push_back(fmt::format("name of material {}: {}", id, material));
    }
    check_read_mesh(mesh, name);
    return std::move(mesh);
}

std::string encode_obj(const TriangleMesh& mesh) {
    check_written_mesh(mesh);
    std::string bytes = "# Sidewall\n";
    for (const Vec3& p : mesh.vertices) bytes += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
    const Attribute* material = mesh.triangle_attribute("material");
    if (material && material->components != 1) material = nullptr;
    std::int32_t last = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (material && (t == 0 || to_int32(material->values[t]) != last)) {
            last = to_int32(material->values[t]);
            bytes += fmt::format("usemtl {}{}\n", kMaterialPrefix, last);
        }
        const auto [a, b, c] = mesh.triangles[t];
        bytes += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    return bytes;
}

}  // namespace sidewall::surface
