// Damaged mesh files of every format: mesh_io_fuzz [SECONDS [SEED]] (mutate.hpp). A reader refuses them with
// a FileError that names the file, or returns a mesh that keeps what read_mesh promises. A seed's kind is its
// format, in the order listed below.
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "surface/curvature.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"
#include "surface/topology.hpp"
#include "tests/fuzz/mutate.hpp"

using namespace sidewall;
using fuzz::expect;

namespace {

using Decode = TriangleMesh (*)(std::string_view);
constexpr std::array<Decode, 4> kDecode{
    [](std::string_view bytes) { return surface::decode_vtp(bytes, "fuzz.vtp"); },
    [](std::string_view bytes) { return surface::decode_ply(bytes, "fuzz.ply"); },
    [](std::string_view bytes) { return surface::decode_stl(bytes, "fuzz.stl"); },
    [](std::string_view bytes) { return surface::decode_obj(bytes, "fuzz.obj"); }};

bool attempt(std::string_view bytes, std::size_t format) {
    try {
        const TriangleMesh mesh = kDecode[format](bytes);
        expect(!mesh.triangles.empty(), "a mesh has triangles");
        for (const Vec3& p : mesh.vertices) expect(p.allFinite(), "coordinates are finite");
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t) expect(v < mesh.vertices.size(), "indices are in range");
        for (const Attribute& a : mesh.vertex_attributes)
            expect(a.values.size() == static_cast<std::size_t>(a.components) * mesh.vertices.size(),
                   "vertex attributes have a value a vertex");
        for (const Attribute& a : mesh.triangle_attributes)
            expect(a.values.size() == static_cast<std::size_t>(a.components) * mesh.triangles.size(),
                   "triangle attributes have a value a triangle");
        surface::analyse_topology(mesh);
        surface::mesh_curvature(mesh);
        return true;
    } catch (const FileError& error) {
        expect(std::string_view(error.what()).starts_with("fuzz."), "an error names the file");
        return false;
    }
}

// Two squares of two triangles, with vertex and triangle attributes of every scalar type.
TriangleMesh small_mesh() {
    TriangleMesh mesh;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 2; ++j) mesh.vertices.emplace_back(i, j, 0.25 * i * j);
    for (std::uint32_t i = 0; i < 4; i += 2) {
        mesh.triangles.push_back({i, i + 2, i + 1});
        mesh.triangles.push_back({i + 1, i + 2, i + 3});
    }
    mesh.vertex_attributes.push_back({"height", 1, Scalar::float32, {0, 1, 2, 3, 4, 5}});
    mesh.triangle_attributes.push_back({"material", 1, Scalar::int32, {0, 0, 1, 1}});
    mesh.triangle_attributes.push_back({"normal", 3, Scalar::float64, std::vector<double>(12, 0.5)});
    return mesh;
}

}  // namespace

int main(int argc, char** argv) {
    const TriangleMesh mesh = small_mesh();
    std::vector<std::string> files{
        surface::encode_vtp(mesh, {{{"unit", "um"}}, {{"time", 1.0}}, {}}),
        surface::encode_ply(mesh),
        surface::encode_stl(mesh),
        surface::encode_obj(mesh),
        "ply\nformat ascii 1.0\ncomment none\nelement vertex 4\nproperty double x\nproperty double y\nproperty double "
        "z\nelement face 1\nproperty list uchar int vertex_indices\nproperty float rate\nend_header\n0 0 0\n1 0 0\n1 1 "
        "0\n0 1 0\n4 0 1 2 3 0.5\n",
        "solid part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n "
        "endfacet\nendsolid part\n",
        "USEMTL a b \nV 0 0 0\nv 1 0 0\nv 0 1 0\nf -3/1/1 -2//2 \\\n-1\n"};
    files.emplace_back(
        "\xef\xbb\xbfv 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 4 0\nv 2 2 0\nv 0 2 0\nv 0 4 0 1 1 1\nf 1/1/1 2 3 4 5 6\nf 6 5 4 7\n");
    files.emplace_back(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement tristrips "
        "1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n7 0 1 2 -1 0 2 3\n");
    std::vector<std::size_t> format{0, 1, 2, 3, 1, 2, 3, 3, 1};
    for (const auto& entry : std::filesystem::directory_iterator(SIDEWALL_SOURCE_DIR "/tests/assets/vtp")) {
        std::ifstream in(entry.path(), std::ios::binary);
        files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
        format.push_back(0);
    }
    const std::vector<std::string> words{"nan",
                                         "inf",
                                         "-1",
                                         "1e308",
                                         "1e-320",
                                         "4294967295",
                                         "18446744073709551615",
                                         "\n",
                                         " ",
                                         "\"",
                                         "<DataArray",
                                         "format=\"ascii\"",
                                         "format=\"binary\"",
                                         "format=\"appended\"",
                                         "type=\"UInt8\"",
                                         "NumberOfComponents=\"64\"",
                                         "NumberOfPoints=\"1000000\"",
                                         "header_type=\"UInt32\"",
                                         "byte_order=\"BigEndian\"",
                                         "property list uint uchar a\n",
                                         "property uchar b\n",
                                         "element face 1000000\n",
                                         "f 1 2 3\n",
                                         "v 0 0 0\n",
                                         "endfacet\n"};
    std::vector<fuzz::Seed> seeds;
    for (std::size_t k = 0; k < files.size(); ++k) seeds.push_back({files[k], format[k]});
    return fuzz::run(argc, argv, seeds, words, attempt);
}
