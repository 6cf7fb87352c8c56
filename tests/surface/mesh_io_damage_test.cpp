#include <catch2/catch.hpp>
#include <fstream>
#include <random>

#include "meshes.hpp"
#include "surface/error.hpp"
#include "surface/mesh_io.hpp"

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

const std::string kPoints = "0 0 0 1 0 0 0 1 0";

std::string file_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Damaged bytes either are refused as a FileError or hold a mesh that keeps every promise of read_mesh.
void survive(const std::string& bytes, bool ply) {
    try {
        const TriangleMesh mesh = ply ? decode_ply(bytes, "fuzz") : decode_vtp(bytes, "fuzz");
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

void fuzz(const std::string& valid, bool ply, unsigned seed, int rounds) {
    std::mt19937 random(seed);
    const auto below = [&](std::size_t n) { return std::size_t(random()) % n; };
    for (int round = 0; round < rounds; ++round) {
        std::string bytes = valid;
        if (round % 3 == 0) bytes.resize(below(bytes.size()));
        // Half the flips hit the head, where a byte means most.
        const std::size_t head = std::min<std::size_t>(bytes.size(), 1500);
        if (round % 3 > 0)
            for (std::size_t flip = 0; flip < 1 + below(4); ++flip) {
                const std::size_t at = below(2) ? below(head) : below(bytes.size());
                bytes[at] = below(2) ? char(bytes[at] ^ char(1 << below(8))) : char(random());
            }
        if (round % 7 == 0 && !bytes.empty()) {
            // A digit more makes a count or an offset wrong by orders of magnitude.
            const std::size_t digit = bytes.find_first_of("0123456789", below(bytes.size()));
            if (digit != std::string::npos) bytes.insert(digit, "9999");
        }
        survive(bytes, ply);
    }
}

}  // namespace

TEST_CASE("a damaged VTP file is refused with its name, the fault and a remedy") {
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

TEST_CASE("a damaged PLY file is refused with its name, the fault and a remedy") {
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

TEST_CASE("a path that is missing, a folder, empty or of another format is refused by name") {
    const auto folder = std::filesystem::temp_directory_path() / "sidewall_mesh_damage_test";
    std::filesystem::create_directories(folder / "folder.vtp");
    std::ofstream(folder / "empty.ply");
    CHECK_THROWS_WITH(read_mesh(folder / "none.vtp"), Contains("none.vtp") && Contains("no such file"));
    CHECK_THROWS_WITH(read_mesh(folder / "folder.vtp"), Contains("is a folder"));
    CHECK_THROWS_WITH(read_mesh(folder / "empty.ply"), Contains("is empty"));
    CHECK_THROWS_WITH(read_mesh("part.stl"), Contains("not supported yet: convert to VTP or PLY"));
    CHECK_THROWS_WITH(write_mesh("part.obj", test::plane_mesh(1)), Contains("not supported yet"));
    CHECK_THROWS_WITH(read_mesh("part.txt"), Contains("'.txt'"));
    CHECK_THROWS_AS(read_mesh("part"), FileError);
}

TEST_CASE("random truncations and flipped bytes never get past the readers") {
    TriangleMesh mesh = test::sphere_mesh(1, 1.0);
    mesh.vertex_attributes.push_back(
        {"height", 1, Scalar::float32, std::vector<double>(mesh.vertices.size(), 0.5)});
    mesh.triangle_attributes.push_back(
        {"normal", 3, Scalar::int32, std::vector<double>(3 * mesh.triangles.size())});
    fuzz(encode_vtp(mesh, {{{"unit", "um"}}, {{"time", 1.0}}}), false, 1, 6000);
    fuzz(encode_ply(mesh), true, 2, 6000);
    fuzz(ascii_ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), true, 3, 4000);
    unsigned seed = 4;
    for (const auto* name : {"ascii", "inline_zlib_uint64", "inline_big_endian", "appended_raw",
                             "appended_base64_zlib", "appended_raw_zlib"}) {
        const std::string bytes =
            file_bytes(std::string(SIDEWALL_SOURCE_DIR "/tests/assets/vtp/") + name + ".vtp");
        REQUIRE(!bytes.empty());
        fuzz(bytes, false, seed++, 3000);
    }
}
