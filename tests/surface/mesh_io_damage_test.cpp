#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <random>

#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"
#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;
using Catch::Matchers::Contains;

namespace {

std::string ascii_vtp(const std::string& points, const std::string& connectivity, const std::string& offsets,
                      const std::string& counts = "NumberOfPoints=\"3\" NumberOfPolys=\"1\"") {
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\"><PolyData><Piece " + counts +
           "><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" + points +
           "</DataArray></Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" +
           connectivity + "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" +
           offsets + "</DataArray></Polys></Piece></PolyData></VTKFile>\n";
}

std::string ascii_ply(const std::string& body, const std::string& vertices = "3",
                      const std::string& faces = "1") {
    return "ply\nformat ascii 1.0\nelement vertex " + vertices +
           "\nproperty double x\nproperty double y\nproperty double z\nelement face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n" + body;
}

const std::string kAsciiStl =
    "solid part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n"
    "  endloop\n endfacet\nendsolid part\n";

const std::string kPoints = "0 0 0 1 0 0 0 1 0";

std::string file_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Readers refuse damaged bytes with a FileError or return a mesh that keeps every promise of read_mesh.
using Decode = TriangleMesh (*)(const std::string&);

TriangleMesh vtp(const std::string& bytes) {
    return decode_vtp(bytes, "fuzz");
}
TriangleMesh ply(const std::string& bytes) {
    return decode_ply(bytes, "fuzz");
}
TriangleMesh stl(const std::string& bytes) {
    return decode_stl(bytes, "fuzz");
}
TriangleMesh obj(const std::string& bytes) {
    return decode_obj(bytes, "fuzz");
}

void survive(const std::string& bytes, Decode decode) {
    try {
        const TriangleMesh mesh = decode(bytes);
        REQUIRE(!mesh.triangles.empty());
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t) REQUIRE(v < mesh.vertices.size());
        for (const Vec3& p : mesh.vertices) REQUIRE(p.allFinite());
        for (const Attribute& a : mesh.vertex_attributes)
            REQUIRE(a.values.size() == std::size_t(a.components) * mesh.vertices.size());
        for (const Attribute& a : mesh.triangle_attributes)
            REQUIRE(a.values.size() == std::size_t(a.components) * mesh.triangles.size());
    } catch (const FileError& error) {
        REQUIRE_THAT(error.what(), Contains("fuzz"));
    }
}

void fuzz(const std::string& valid, Decode decode, unsigned seed, int rounds) {
    std::mt19937 random(seed);
    const auto below = [&](std::size_t n) { return std::size_t(random()) % n; };
    for (int round = 0; round < rounds; ++round) {
        std::string bytes = valid;
        if (round % 3 == 0) bytes.resize(below(bytes.size()));
        // Half of the flips hit the header, where a byte has most effect.
        const std::size_t head = std::min<std::size_t>(bytes.size(), 1500);
        if (round % 3 > 0)
            for (std::size_t flip = 0; flip < 1 + below(4); ++flip) {
                const std::size_t at = below(2) ? below(head) : below(bytes.size());
                bytes[at] = below(2) ? char(bytes[at] ^ char(1 << below(8))) : char(random());
            }
        if (round % 7 == 0 && !bytes.empty()) {
            // More digits make a count or an offset wrong by orders of magnitude.
            const std::size_t digit = bytes.find_first_of("0123456789", below(bytes.size()));
            if (digit != std::string::npos) bytes.insert(digit, "9999");
        }
        survive(bytes, decode);
    }
}

}  // namespace

TEST_CASE("a damaged VTP file is refused with its name, the fault and a remedy", "[foreign]") {
    const auto [bytes, message] = GENERATE(table<std::string, std::string>({
        {"<VTKFile", "well-formed"},
        {"solid cube\n", "well-formed"},
        {"<?xml version=\"1.0\"?><html/>", "no VTK XML file"},
        {"<VTKFile type=\"UnstructuredGrid\"></VTKFile>", "extract the surface"},
        {"<VTKFile type=\"PolyData\" compressor=\"vtkLZ4DataCompressor\"></VTKFile>", "zlib"},
        {"<VTKFile type=\"PolyData\"><PolyData></PolyData></VTKFile>", "no triangle"},
        {ascii_vtp(kPoints, "0 1 3", "3"), "vertex 3 of 3"},
        {ascii_vtp(kPoints, "0 1 -1", "3"), "vertex -1"},
        {ascii_vtp(kPoints, "0 1 2", "2"), "fewer than 3"},
        {ascii_vtp(kPoints, "0 1 2", "-4"), "fewer than 3"},
        {ascii_vtp(kPoints, "0 1 2", "30"), "fewer than 30 values"},
        {ascii_vtp("0 0 0 1 0 0 0 1", "0 1 2", "3"), "has 8 values, not 9"},
        {ascii_vtp("0 0 0 1 0 0 0 1 nan", "0 1 2", "3"), "not finite"},
        {ascii_vtp("0 0 0 1 0 0 0 1 inf", "0 1 2", "3"), "not finite"},
        {ascii_vtp("0 0 0 1 0 0 0 1 1e300", "0 1 2", "3"), "length unit"},
        {ascii_vtp("0 0 0 1 0 0 0 1 x", "0 1 2", "3"), "has 'x'"},
        {ascii_vtp(kPoints, "0 1 2", "3", "NumberOfPoints=\"4000000000\" NumberOfPolys=\"1\""), "fewer than"},
        {ascii_vtp(kPoints, "0 1 2", "3", "NumberOfPoints=\"18446744073709551615\" NumberOfPolys=\"1\""),
         "declares"},
        {ascii_vtp(kPoints, "0 1 2", "3", "NumberOfPoints=\"-3\" NumberOfPolys=\"1\""), "whole number"},
        {ascii_vtp(kPoints, "0 1 2", "3", "NumberOfPoints=\"3\" NumberOfPolys=\"0\""), "no triangle"},
        {ascii_vtp(kPoints, "0 1 2", "3", "NumberOfPoints=\"3\" NumberOfLines=\"1\""), "line cells"},
    }));
    CAPTURE(bytes);
    REQUIRE_THROWS_AS(decode_vtp(bytes, "dir/part.vtp"), FileError);
    REQUIRE_THROWS_WITH(decode_vtp(bytes, "dir/part.vtp"), Contains("dir/part.vtp") && Contains(message));
}

TEST_CASE("a damaged PLY file is refused with its name, the fault and a remedy", "[foreign]") {
    const std::string xyz = "0 0 0\n1 0 0\n0 1 0\n";
    const auto [bytes, message] = GENERATE_COPY(table<std::string, std::string>({
        {"plywood", "ends within its header"},
        {"solid cube\n", "no PLY file"},
        {"ply\nformat ascii 1.0\nelement vertex 3\n", "ends within its header"},
        {"ply\nformat ascii 2.0\nend_header\n", "unknown"},
        {"ply\nend_header\n", "no format line"},
        {"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "whole number"},
        {"ply\nformat ascii 1.0\nelement vertex 3\nproperty quad x\nend_header\n", "'quad' is unknown"},
        {"ply\nformat ascii 1.0\nhello\nend_header\n", "'hello'"},
        {"ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n", "have no x"},
        {ascii_ply(xyz + "3 0 1 3\n"), "vertex 3 of 3"},
        {ascii_ply(xyz + "3 0 1 -1\n"), "vertex -1"},
        {ascii_ply(xyz + "2 0 1\n"), "at least 3"},
        {ascii_ply(xyz + "-1 0 1\n"), "cut off"},
        {ascii_ply(xyz + "3 0 1\n"), "cut off"},
        {ascii_ply(xyz + "3 0 1 two\n"), "'two"},
        {ascii_ply("0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n"), "not finite"},
        {ascii_ply(xyz, "3", "0"), "no triangle"},
        {ascii_ply(xyz + "3 0 1 2\n", "3000000000"), "more than the file holds"},
        {ascii_ply(xyz + "3 0 1 2\n", "3", "99999999999"), "too many"},
    }));
    CAPTURE(bytes);
    REQUIRE_THROWS_AS(decode_ply(bytes, "dir/part.ply"), FileError);
    REQUIRE_THROWS_WITH(decode_ply(bytes, "dir/part.ply"), Contains("dir/part.ply") && Contains(message));
}

TEST_CASE("a damaged STL file is refused with its name, the fault and a remedy", "[foreign]") {
    std::string binary(80, 'x');
    binary += std::string("\2\0\0\0", 4) + std::string(50, '\0');
    const auto [bytes, message] = GENERATE_COPY(table<std::string, std::string>({
        {"ply\n", "cut off or of another kind"},
        {binary, "for 2 facets of binary STL"},
        {"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n", "part.stl:4: '"},
        {"solid x\nfacet normal 0 0 1\nvertex 0 0 0\nendfacet\n", "part.stl:4: facet of 1 corners"},
        {"solid x\nfacet\nvertex 0 0 0\nvertex 1 0 0\n", "ends within a facet"},
        {"solid x\nhello\n", "'hello'"},
        {"solid x\nendsolid x\n", "no triangle"},
        {"solid x\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 nan 0\nendfacet\n", "not finite"},
        {"solid x\nfacet\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 1 0\nendfacet\n", "no triangle"},
    }));
    CAPTURE(bytes);
    REQUIRE_THROWS_AS(decode_stl(bytes, "dir/part.stl"), FileError);
    REQUIRE_THROWS_WITH(decode_stl(bytes, "dir/part.stl"), Contains("dir/part.stl") && Contains(message));
}

TEST_CASE("a damaged OBJ file is refused with its name, the fault and a remedy", "[foreign]") {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const auto [bytes, message] = GENERATE_COPY(table<std::string, std::string>({
        {"hello\n", "no triangle"},
        {"\1\2\n", "no OBJ statement"},
        {"v 0 0\n", "part.obj:1: '' instead of a coordinate"},
        {"v 0 0 x\n", "'x' instead of a coordinate"},
        {"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"},
        {vertices + "f 1 2\n", "part.obj:4: face of 2 vertices"},
        {vertices + "f 1 2 0\n", "face names vertex 0"},
        {vertices + "f 1 2 -4\n", "face names vertex -4"},
        {vertices + "f 1 2 4\n", "vertex 3 of 3"},
        {vertices + "f 1 2 three\n", "'three' instead of a vertex number"},
        {vertices, "no triangle"},
    }));
    CAPTURE(bytes);
    REQUIRE_THROWS_AS(decode_obj(bytes, "dir/part.obj"), FileError);
    REQUIRE_THROWS_WITH(decode_obj(bytes, "dir/part.obj"), Contains("dir/part.obj") && Contains(message));
}

TEST_CASE("a small file that unfolds to gigabytes is refused before it does", "[foreign]") {
    // An attribute of zeros, which compresses to almost nothing, listed 3000 times more.
    TriangleMesh mesh = test::plane_mesh(100);
    mesh.vertex_attributes.push_back(
        {"zero", 1, Scalar::float64, std::vector<double>(mesh.vertices.size(), 0.0)});
    std::string bytes = encode_vtp(mesh);
    const std::size_t begin = bytes.rfind('\n', bytes.find("Name=\"zero\"")),
                      end = bytes.find('\n', begin + 1);
    const std::string line = bytes.substr(begin, end - begin);
    std::string lines;
    for (int k = 0; k < 3000; ++k) lines += line;
    const std::string bomb = bytes.substr(0, end) + lines + bytes.substr(end);
    CHECK_THROWS_WITH(vtp(bomb), Contains("fuzz: unfolds to over"));
    CHECK(vtp(bytes).vertices.size() == mesh.vertices.size());

    // One face of many corners: each triangle of its fan would repeat every property.
    std::string ply_bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar "
        "z\nelement face 1\nproperty list uint uchar vertex_indices\n";
    constexpr std::uint32_t kCorners = 60000;
    for (int k = 0; k < 1000; ++k) ply_bytes += "property uchar p" + std::to_string(k) + "\n";
    ply_bytes += "end_header\n" + std::string(9, '\1');
    for (int k = 0; k < 4; ++k) ply_bytes += static_cast<char>(kCorners >> (8 * k) & 0xff);
    ply_bytes += std::string(kCorners, '\2') + std::string(1000, '\0');
    CHECK_THROWS_WITH(ply(ply_bytes), Contains("fuzz: unfolds to over"));
}

TEST_CASE("a path that is missing, a folder, empty or of another format is refused by name", "[foreign]") {
    const auto folder = std::filesystem::temp_directory_path() / "sidewall_mesh_damage_test";
    std::filesystem::create_directories(folder / "folder.vtp");
    std::ofstream(folder / "empty.ply");
    CHECK_THROWS_WITH(read_mesh(folder / "none.vtp"), Contains("none.vtp") && Contains("no such file"));
    CHECK_THROWS_WITH(read_mesh(folder / "folder.vtp"), Contains("is a folder"));
    CHECK_THROWS_WITH(read_mesh(folder / "empty.ply"), Contains("is empty"));
    std::filesystem::remove(folder / "pipe.stl");
    REQUIRE(mkfifo((folder / "pipe.stl").c_str(), 0600) == 0);
    CHECK_THROWS_WITH(read_mesh(folder / "pipe.stl"), Contains("pipe.stl: is a pipe"));
    CHECK_THROWS_WITH(write_mesh("part.txt", test::plane_mesh(1)), Contains("use .vtp, .ply, .stl or .obj"));
    CHECK_THROWS_WITH(read_mesh("part.txt"), Contains("'.txt'"));
    CHECK_THROWS_AS(read_mesh("part"), FileError);
}

TEST_CASE("random truncations and flipped bytes never get past the readers", "[foreign]") {
    TriangleMesh mesh = test::sphere_mesh(1, 1.0);
    mesh.vertex_attributes.push_back(
        {"height", 1, Scalar::float32, std::vector<double>(mesh.vertices.size(), 0.5)});
    mesh.triangle_attributes.push_back(
        {"normal", 3, Scalar::int32, std::vector<double>(3 * mesh.triangles.size())});
    fuzz(encode_vtp(mesh, {{{"unit", "um"}}, {{"time", 1.0}}, {}}), vtp, 1, 6000);
    fuzz(encode_ply(mesh), ply, 2, 6000);
    fuzz(ascii_ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), ply, 3, 4000);
    fuzz(encode_stl(mesh), stl, 21, 6000);
    fuzz(kAsciiStl, stl, 22, 4000);
    fuzz(encode_obj(mesh), obj, 23, 6000);
    fuzz("usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3/1/1 -2//2 \\\n-1\n", obj, 24, 4000);
    unsigned seed = 4;
    for (const auto* name : {"ascii", "inline_zlib_uint64", "inline_big_endian", "appended_raw",
                             "appended_base64_zlib", "appended_raw_zlib"}) {
        const std::string bytes =
            file_bytes(std::string(SIDEWALL_SOURCE_DIR "/tests/assets/vtp/") + name + ".vtp");
        REQUIRE(!bytes.empty());
        fuzz(bytes, vtp, seed++, 3000);
    }
}
