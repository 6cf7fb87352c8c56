#include <catch2/catch.hpp>
#include <cctype>

#include "surface/error.hpp"
#include "surface/files/mesh_bytes.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"

// Mesh files in the spellings of other programs.
using namespace sidewall;
using namespace sidewall::surface;
using Catch::Matchers::Contains;

namespace {

const std::string kMark = "\xef\xbb\xbf";

// A square of two facets at z = 0; \p end is the spelling of "end" in the closing keywords.
std::string square_stl(const std::string& end = "end", const std::string& third = "1 1 0") {
    return "solid t\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex " +
           third + "\n  " + end + "loop\n " + end +
           "facet\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 1 0\n" +
           "   vertex 0 1 0\n  " + end + "loop\n " + end + "facet\n" + end + "solid t\n";
}

std::string upper(std::string text) {
    for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

std::string ply_of(const std::string& elements, const std::string& body) {
    return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + body;
}

const std::string kPlyVertices =
                      "element vertex 4\nproperty double x\nproperty double y\nproperty double z\n",
                  kPlyFaces = "element face 1\nproperty list uchar int vertex_indices\n",
                  kPlySquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

void check_square(const TriangleMesh& mesh) {
    CHECK(mesh.vertices.size() == 4);
    CHECK(mesh.triangles.size() == 2);
    CHECK(total_area(mesh) == Approx(1.0));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) CHECK(area_vector(mesh, t).z() > 0.0);
}

}  // namespace

TEST_CASE("STL text is read in any case, with spaces in its keywords and with a byte order mark",
          "[foreign]") {
    for (const std::string& text :
         {square_stl(), upper(square_stl()), square_stl("end "), kMark + square_stl(),
          kMark + upper(square_stl("end ")), "\n  " + square_stl("End\t")})
        check_square(decode_stl(text, "t.stl"));
    CHECK_THROWS_WITH(decode_stl(std::string("\xff\xfes\0o\0", 6), "t.stl"), Contains("t.stl: is UTF-16"));
}

TEST_CASE("a binary STL whose title begins with solid may have bytes behind its facets", "[foreign]") {
    std::string bytes = encode_stl(decode_stl(square_stl(), "t.stl"));
    for (const char* title : {"solid exported", "SOLID", "Sidewall", "\xef\xbb\xbfsolid t"}) {
        bytes.replace(0, 80, std::string(title) + std::string(80 - std::string(title).size(), ' '));
        for (const std::size_t more : {0, 1, 20, 50, 1000})
            check_square(decode_stl(bytes + std::string(more, '\0'), "t.stl"));
        check_square(decode_stl(bytes + "made by hand", "t.stl"));
        CHECK_THROWS_WITH(decode_stl(bytes.substr(0, bytes.size() - 1), "t.stl"), Contains("cut off"));
    }
}

TEST_CASE("PLY and OBJ are read with a byte order mark", "[foreign]") {
    const std::string ply = ply_of(kPlyVertices + kPlyFaces, kPlySquare + "4 0 1 2 3\n"),
                      obj = "# by hand\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    for (const std::string& mark : {std::string(), kMark}) {
        check_square(decode_ply(mark + ply, "t.ply"));
        check_square(decode_obj(mark + obj, "t.obj"));
    }
    check_square(
        decode_obj("V 0 0 0\nV 1 0 0\nV 1 1 0\nV 0 1 0\nVN 0 0 1\nF 1//1 2//1 3//1 4//1\n", "t.obj"));
    const TriangleMesh two = decode_obj(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nUSEMTL dark red \nf 1 2 3\nusemtl dark blue\nf 1 3 4\nusemtl dark red\n",
        "t.obj");
    REQUIRE(two.triangle_attribute("material") != nullptr);
    CHECK(two.triangle_attribute("material")->values == std::vector<double>{0, 1});
    CHECK_THROWS_WITH(decode_obj("\xfe\xff", "t.obj"), Contains("t.obj: is UTF-16"));
    CHECK_THROWS_WITH(decode_obj("v 0 0 0\n\xc2\xa0 1\n", "t.obj"), Contains("t.obj:2: '"));
}

TEST_CASE("lines of mesh files end with a line feed, a carriage return or both", "[foreign]") {
    const std::string ply = ply_of(kPlyVertices + kPlyFaces, kPlySquare + "4 0 1 2 3\n"),
                      obj = "# by hand\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4\n";
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        const auto ended = [&](std::string text) {
            for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += end.size())
                text.replace(at, 1, end);
            return text;
        };
        check_square(decode_stl(ended(square_stl()), "t.stl"));
        check_square(decode_ply(ended(ply), "t.ply"));
        check_square(decode_obj(ended(obj), "t.obj"));
        CHECK_THROWS_WITH(decode_obj(ended("v 0 0 0\n\nv 1 0 x\n"), "t.obj"), Contains("t.obj:3: 'x"));
        CHECK_THROWS_WITH(decode_stl(ended("solid\nfacet\nvertex 0 0 x\n"), "t.stl"),
                          Contains("t.stl:3: 'x"));
        // The header's last line is followed by binary values, whose first byte is that of a line feed.
        std::string binary = ended(
            "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
            "property float y\nproperty float z\n" +
            kPlyFaces + "end_header\n");
        for (const float value : {std::bit_cast<float>(0x0au), 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f})
            append_value(binary, value);
        append_value<std::uint8_t>(binary, 3);
        for (const std::int32_t vertex : {0, 1, 2}) append_value(binary, vertex);
        CHECK(total_area(decode_ply(binary, "t.ply")) == Approx(0.5));
    }
}

TEST_CASE("PLY triangle strips alternate, and minus one begins another", "[foreign]") {
    const std::string strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    check_square(decode_ply(ply_of(kPlyVertices + strips, kPlySquare + "4 0 1 3 2\n"), "t.ply"));
    check_square(decode_ply(ply_of(kPlyVertices + strips, kPlySquare + "7 0 1 2 -1 0 2 3\n"), "t.ply"));
    // Repeated corners flip the strip but make no triangle; an empty face element before it is ignored.
    const std::string none = "element face 0\nproperty list uchar int vertex_indices\n";
    check_square(decode_ply(ply_of(kPlyVertices + none + strips, kPlySquare + "6 1 1 1 2 0 3\n"), "t.ply"));
    CHECK_THROWS_WITH(decode_ply(ply_of(kPlyVertices + strips, kPlySquare + "3 0 1 -2\n"), "t.ply"),
                      Contains("names vertex -2"));
    CHECK_THROWS_WITH(decode_ply(ply_of(kPlyVertices + kPlyFaces, kPlySquare + "4 0 1 -1 2\n"), "t.ply"),
                      Contains("names vertex -1"));
}

TEST_CASE("a number followed by anything is refused in every column of every format", "[foreign]") {
    const auto vtp = [](const std::string& points) {
        return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points>"
               "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" +
               points +
               "</DataArray></Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2"
               "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece>"
               "</PolyData></VTKFile>";
    };
    CHECK_NOTHROW(decode_vtp(vtp("0 0 0 1 0 0 0 +1 0"), "t.vtp"));
    // VTK writes what it knows of an array within it, which is no value.
    const std::string key =
        "<InformationKey name=\"L2_NORM_RANGE\" length=\"2\"><Value index=\"0\">0</Value></InformationKey>";
    CHECK(decode_vtp(vtp("0 0 0 1 0 0 0 1 0" + key), "t.vtp").vertices ==
          decode_vtp(vtp("0 0 0 1 0 0 0 1 0"), "t.vtp").vertices);
    for (const std::string bad : {"1,5", "1.5D-01", "1.5um", "0x1", "1e5x", "--1", "+-1", "1'000"}) {
        INFO(bad);
        for (int column = 0; column < 3; ++column) {
            std::string point;
            for (int k = 0; k < 3; ++k) point += (k == column ? bad : std::string("1")) + (k < 2 ? " " : "");
            CHECK_THROWS_WITH(decode_stl(square_stl("end", point), "t.stl"), Contains("t.stl:6: '" + bad));
            CHECK_THROWS_WITH(
                decode_ply(ply_of(kPlyVertices + kPlyFaces, "0 0 0\n1 0 0\n" + point + "\n0 1 0\n3 0 1 2\n"),
                           "t.ply"),
                Contains("vertex 2 has '" + bad));
            CHECK_THROWS_WITH(decode_obj("v 0 0 0\nv 1 0 0\nv " + point + "\nf 1 2 3\n", "t.obj"),
                              Contains("t.obj:3: '" + bad));
            CHECK_THROWS_WITH(decode_obj("vn " + point + "\n", "t.obj"), Contains("t.obj:1: '" + bad));
            CHECK_THROWS_WITH(decode_vtp(vtp("0 0 0 1 0 0 " + point), "t.vtp"), Contains("has '" + bad));
            CHECK_THROWS_WITH(decode_stl("solid\nfacet normal " + point + "\n", "t.stl"),
                              Contains("t.stl:2: '" + bad));
        }
        CHECK_THROWS_WITH(decode_obj("v 0 0 0 " + bad + "\n", "t.obj"), Contains("t.obj:1: '" + bad));
        CHECK_THROWS_WITH(decode_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/" + bad + " 2 3\n", "t.obj"),
                          Contains("t.obj:4: '1/"));
        CHECK_THROWS_WITH(decode_stl(square_stl("end", "1 1 0 " + bad), "t.stl"),
                          Contains("instead of the line's end"));
    }
    // A decimal comma must not be read as z = -1.
    CHECK_THROWS_WITH(decode_stl(square_stl("end", "1 -1 -1,5"), "t.stl"),
                      Contains("'-1,5' instead of a number"));
}

TEST_CASE("polygons that are not convex cover themselves and nothing else", "[foreign]") {
    // An L and the square that completes it to 4 x 4; not every corner of the L sees all of it.
    const std::string corners = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 4 0\nv 2 2 0\nv 0 2 0\nv 0 4 0\n";
    for (const char* first :
         {"1 2 3 4 5 6", "2 3 4 5 6 1", "3 4 5 6 1 2", "4 5 6 1 2 3", "5 6 1 2 3 4", "6 1 2 3 4 5"}) {
        const TriangleMesh mesh = decode_obj(corners + "f " + first + "\nf 6 5 4 7\n", "t.obj");
        CHECK(mesh.triangles.size() == 6);
        CHECK(total_area(mesh) == Approx(16.0).epsilon(1e-14));
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) CHECK(area_vector(mesh, t).z() > 0.0);
    }
    // An arrowhead of area 4 x 2 / 2 - 4 x 1 / 2 = 2, listed from each of its four corners, flat or on a
    // wall.
    for (const char* face : {"f 1 2 3 4\n", "f 2 3 4 1\n", "f 3 4 1 2\n", "f 4 1 2 3\n"})
        for (const char* points :
             {"v 0 0 0\nv 2 1 0\nv 4 0 0\nv 2 2 0\n", "v 1 0 0\nv 1 2 1\nv 1 4 0\nv 1 2 2\n"})
            CHECK(total_area(decode_obj(std::string(points) + face, "t.obj")) == Approx(2.0).epsilon(1e-14));
    // A comb: a bar of 20 x 1 with 20 teeth of 0.5 x 2, a corner in the middle of every tooth's top. Its area
    // is 20 x 0.5 x 2 + 20.
    std::string comb;
    std::string face = "f";
    int count = 0;
    const auto add = [&](double x, double y) {
        comb += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
        face += " " + std::to_string(++count);
    };
    add(0, 0);
    add(20, 0);
    for (int i = 19; i >= 0; --i) {
        add(i + 1.0, 1);
        add(i + 0.5, 1);
        add(i + 0.5, 3);
        add(i + 0.25, 3);
        add(i, 3);
        add(i, 1);
    }
    const TriangleMesh teeth = decode_obj(comb + face + "\n", "t.obj");
    CHECK(teeth.triangles.size() == static_cast<std::size_t>(count) - 2);
    CHECK(total_area(teeth) == Approx(40.0).epsilon(1e-12));
    // PLY faces are triangulated by the same code; the triangles keep their face's values.
    const std::string faces =
        "element vertex 6\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n"
        "property list uchar int vertex_indices\nproperty int material\n";
    const TriangleMesh ply =
        decode_ply(ply_of(faces, "0 0 0\n4 0 0\n4 4 0\n2 4 0\n2 2 0\n0 2 0\n6 0 1 2 3 4 5 7\n"), "t.ply");
    CHECK(total_area(ply) == Approx(12.0).epsilon(1e-14));
    CHECK(ply.triangle_attribute("material")->values == std::vector<double>(4, 7.0));
}

TEST_CASE("a polygon that crosses itself is refused with its place", "[foreign]") {
    CHECK_THROWS_WITH(decode_obj("v 1 1 0\nv 5 1 0\nv 5 5 0\nv 3 -1 0\nv 1 5 0\nf 1 2 3 4 5\n", "t.obj"),
                      Contains("t.obj: the polygon of 5 corners at (1, 1, 0) crosses itself"));
    // A figure of eight whose loops have opposite signed areas.
    CHECK_THROWS_WITH(decode_obj("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 4\n", "t.obj"),
                      Contains("4 corners at (0, 0, 0) crosses itself"));
}
