#include "surface/files/mesh_io.hpp"
#include "surface/topology.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "surface/error.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"
#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

namespace {

TriangleMesh decorated_mesh() {
    TriangleMesh mesh = test::sphere_mesh(2, 1.0 / 3.0);
    test::shake(mesh, 0.01, 1);
    const std::size_t n = mesh.vertices.size(), m = mesh.triangles.size();
    const auto fill = [](Attribute a, std::size_t count) {
        a.values.resize(count * std::size_t(a.components));
        for (std::size_t i = 0; i < a.values.size(); ++i)
            a.values[i] = a.type == Scalar::int32     ? double(i) - 10.0
                          : a.type == Scalar::float32 ? double(float(0.1 * double(i)))
                                                      : 0.1 * double(i);
        return a;
    };
    mesh.vertex_attributes = {fill({"flux", 1, Scalar::float64, {}}, n),
                              fill({"velocity", 3, Scalar::float32, {}}, n)};
    mesh.triangle_attributes = {fill({"material", 1, Scalar::int32, {}}, m),
                                fill({"flux <Cl> & \"F\"", 1, Scalar::float64, {}}, m)};
    return mesh;
}

void require_same(const Attribute& a, const Attribute& b) {
    CHECK(a.name == b.name);
    CHECK(a.components == b.components);
    CHECK(a.type == b.type);
    CHECK(a.values == b.values);
}

void require_same_shape(const TriangleMesh& a, const TriangleMesh& b) {
    REQUIRE(a.vertices.size() == b.vertices.size());
    for (std::size_t i = 0; i < a.vertices.size(); ++i) REQUIRE(a.vertices[i] == b.vertices[i]);
    REQUIRE(a.triangles == b.triangles);
}

std::filesystem::path scratch(const std::string& name) {
    const auto folder = std::filesystem::temp_directory_path() / "sidewall_mesh_io_test";
    std::filesystem::create_directories(folder);
    return folder / name;
}

}  // namespace

TEST_CASE("a mesh written as VTP reads back to the last bit, attributes and units included", "[foreign]") {
    const TriangleMesh mesh = decorated_mesh();
    using namespace std::string_literals;
    const std::string names = "Si\0In0.5,Ga0.5As\0\0a\"b\nc"s;
    const MeshMetadata said{{{"length_unit", "um"}, {"note", "a < b & \"c\""}, {"names", names}},
                            {{"time", 0.1}}};
    MeshMetadata heard;
    const auto path = scratch("round.vtp");
    write_mesh(path, mesh, said);
    const TriangleMesh back = read_mesh(path, &heard);
    require_same_shape(mesh, back);
    REQUIRE(back.vertex_attributes.size() == 2);
    REQUIRE(back.triangle_attributes.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
        require_same(mesh.vertex_attributes[i], back.vertex_attributes[i]);
        require_same(mesh.triangle_attributes[i], back.triangle_attributes[i]);
    }
    CHECK(heard.texts == said.texts);
    CHECK(heard.numbers == said.numbers);
    CHECK_FALSE(std::filesystem::exists(path.string() + ".partial"));
}

TEST_CASE("a VTP array longer than one compressed block reads back to the last bit", "[foreign]") {
    const TriangleMesh mesh = test::torus_mesh(150, 1.0, 0.3);
    require_same_shape(mesh, decode_vtp(encode_vtp(mesh), "memory"));
}

TEST_CASE("the same mesh gives the same file bytes", "[foreign]") {
    const TriangleMesh mesh = decorated_mesh();
    CHECK(encode_vtp(mesh) == encode_vtp(decorated_mesh()));
    CHECK(encode_ply(mesh) == encode_ply(decorated_mesh()));
}

TEST_CASE("a mesh written as PLY reads back to the last bit, components as properties of their own",
          "[foreign]") {
    const TriangleMesh mesh = decorated_mesh();
    const auto path = scratch("round.ply");
    write_mesh(path, mesh, {{{"length_unit", "um"}}, {{"time", 5.0}}});
    const TriangleMesh back = read_mesh(path);
    require_same_shape(mesh, back);
    REQUIRE(back.vertex_attributes.size() == 4);
    require_same(mesh.vertex_attributes[0], back.vertex_attributes[0]);
    CHECK(back.vertex_attributes[2].name == "velocity_1");
    CHECK(back.vertex_attributes[2].type == Scalar::float32);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        REQUIRE(back.vertex_attributes[2].values[i] == mesh.vertex_attributes[1].values[3 * i + 1]);
    REQUIRE(back.triangle_attributes.size() == 2);
    require_same(mesh.triangle_attributes[0], back.triangle_attributes[0]);
    CHECK(back.triangle_attributes[1].values == mesh.triangle_attributes[1].values);
}

TEST_CASE("every dialect of VTP holds the same surface", "[foreign]") {
    const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 2, 0.1},
                                      {2, 0, 0}, {3, 0, 0}, {2, 1, 0}, {3, 1, 0}, {4, 4, 4}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4},
                                             {5, 6, 7}, {7, 6, 8}, {6, 9, 8}};
    const std::string name = GENERATE("ascii", "inline", "inline_zlib_uint64", "inline_big_endian",
                                      "appended_raw", "appended_raw_zlib", "appended_raw_zlib_big_endian",
                                      "appended_base64", "appended_base64_zlib");
    CAPTURE(name);
    const TriangleMesh mesh = read_mesh(SIDEWALL_SOURCE_DIR "/tests/assets/vtp/" + name + ".vtp");
    CHECK(mesh.vertices == points);
    CHECK(mesh.triangles == triangles);
    const Attribute* height = mesh.vertex_attribute("height");
    REQUIRE(height);
    CHECK(height->values == std::vector<double>{0.0, 1.5, -2.25, 3.0, 1e-3, 5, 6, 7, 8, 9});
    const Attribute* material = mesh.triangle_attribute("material");
    REQUIRE(material);
    CHECK(material->type == Scalar::int32);
    CHECK(material->values == std::vector<double>{7, 7, 9, -1, -1, 3});
    const Attribute* rate = mesh.triangle_attribute("rate");
    REQUIRE(rate);
    CHECK(rate->components == 2);
    CHECK(rate->type == Scalar::float32);
    CHECK(rate->values == std::vector<double>{0.5, 1.5, 0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 4.5, 5.5, 6.5, 7.5});
}

TEST_CASE("ascii, little and big endian PLY hold the same surface", "[foreign]") {
    const std::string properties =
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
        "property short material\nelement edge 1\nproperty int vertex1\nend_header\n";
    struct Row {
        float x, y, z;
        unsigned char red;
    };
    const std::vector<Row> rows = {{0, 0, 0, 1}, {1, 0, 0, 2}, {1, 1, 0, 3}, {0, 1, 0.5f, 255}};
    const std::string ascii =
        "ply\r\nformat ascii 1.0\ncomment made by hand\n" + properties +
        "0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 5e-1 255\n3 0 1 2 2 0.5 0.5 -7\n4 0 1 2 3 0 8\n12\n";
    const auto binary = [&](bool big) {
        std::string bytes =
            std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + properties;
        const auto put = [&](auto value) {
            std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
            if (big) std::reverse(raw.begin(), raw.end());
            bytes += raw;
        };
        for (const Row& r : rows) put(r.x), put(r.y), put(r.z), put(r.red);
        put(std::uint8_t{3}), put(0), put(1), put(2), put(std::uint8_t{2}), put(0.5f), put(0.5f),
            put(std::int16_t{-7});
        put(std::uint8_t{4}), put(0), put(1), put(2), put(3), put(std::uint8_t{0}), put(std::int16_t{8});
        put(12);
        return bytes;
    };
    for (const std::string& bytes : {ascii, binary(false), binary(true)}) {
        const TriangleMesh mesh = decode_ply(bytes, "memory");
        CHECK(mesh.vertices == std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5}});
        CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}});
        REQUIRE(mesh.vertex_attribute("red"));
        CHECK(mesh.vertex_attribute("red")->values == std::vector<double>{1, 2, 3, 255});
        REQUIRE(mesh.triangle_attribute("material"));
        CHECK(mesh.triangle_attribute("material")->values == std::vector<double>{-7, 8, 8});
    }
}

TEST_CASE("an attribute of the wrong length is refused before anything is written", "[foreign]") {
    TriangleMesh mesh = test::plane_mesh(1);
    mesh.triangle_attributes.push_back({"flux", 1, Scalar::float64, {1.0}});
    const auto path = scratch("never.vtp");
    std::filesystem::remove(path);
    CHECK_THROWS_AS(write_mesh(path, mesh), GeometryError);
    CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("a mesh that cannot be written is an i/o error and leaves nothing behind", "[foreign]") {
    const auto blocker = scratch("blocker");
    std::ofstream(blocker) << "a file, not a folder";
    CHECK_THROWS_AS(write_mesh(blocker / "mesh.vtp", test::plane_mesh(1)), IoError);
    const auto folder = scratch("folder.vtp");
    std::filesystem::create_directories(folder);
    CHECK_THROWS_AS(write_mesh(folder, test::plane_mesh(1)), IoError);
    CHECK_FALSE(std::filesystem::exists(folder.string() + ".partial"));
}

TEST_CASE("a mesh written as STL reads back in single precision, its surface closed again", "[foreign]") {
    const TriangleMesh fine = test::sphere_mesh(2, 1.0);
    TriangleMesh mesh = decode_stl(encode_stl(fine), "memory");  // rounded to single precision
    REQUIRE(mesh.vertices.size() == fine.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        CHECK((triangle_centroid(mesh, t) - triangle_centroid(fine, t)).norm() < 1e-7);
    const auto path = scratch("round.STL");
    write_mesh(path, mesh);
    const TriangleMesh back = read_mesh(path);
    REQUIRE(back.vertices.size() == mesh.vertices.size());
    REQUIRE(back.triangles.size() == mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            CHECK(back.vertices[back.triangles[t][k]] == mesh.vertices[mesh.triangles[t][k]]);
    CHECK(analyse_topology(back).closed());
    CHECK(back.triangle_attributes.empty());
    mesh.triangle_attributes.push_back({"attribute", 1, Scalar::int32, {}});
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        mesh.triangle_attributes[0].values.push_back(double(t % 7));
    require_same(mesh.triangle_attributes[0],
                 decode_stl(encode_stl(mesh), "memory").triangle_attributes.at(0));
}

TEST_CASE("ascii STL is read as programs write it, coinciding corners named", "[foreign]") {
    MeshMetadata said;
    const TriangleMesh mesh = decode_stl(
        "solid a name with facet in it\r\n  facet normal 0 0 1\r\n    outer loop\r\n      vertex 0 0 +0\r\n"
        "      vertex 1.0e0 0 -0\r\n      VERTEX 0 1 0\r\n    endloop\r\n  endfacet\r\n"
        "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "endsolid",
        "part.stl", &said);
    CHECK(mesh.vertices.size() == 4);
    CHECK(mesh.triangles.size() == 2);
    CHECK(said.dropped == std::vector<std::string>{"1 facets with coinciding corners"});
}

TEST_CASE("a mesh written as OBJ reads back to the last bit, with its materials", "[foreign]") {
    TriangleMesh mesh = decorated_mesh();
    const auto path = scratch("round.obj");
    write_mesh(path, mesh);
    const TriangleMesh back = read_mesh(path);
    require_same_shape(mesh, back);
    REQUIRE(back.triangle_attributes.size() == 1);
    CHECK(back.triangle_attributes[0].name == "material");
    CHECK(back.triangle_attributes[0].type == Scalar::int32);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        CHECK(back.triangle_attributes[0].values[t] == double(int(mesh.triangle_attributes[0].values[t])));
    CHECK(unwritable(path, mesh) == std::vector<std::string>{mesh.vertex_attributes[0].name,
                                                             mesh.vertex_attributes[1].name,
                                                             mesh.triangle_attributes[1].name});
    CHECK(unwritable("x.stl", mesh).size() == 4);
    CHECK(unwritable("x.vtp", mesh).empty());
}

TEST_CASE("OBJ of other programs: polygons, all index forms, negative numbers, materials by name",
          "[foreign]") {
    MeshMetadata said;
    const TriangleMesh mesh = decode_obj(
        "# made elsewhere\nmtllib x.mtl\no part\nv 0 0 0 1.0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\n"
        "usemtl steel\nf 1/1/1 2//1 3/1 4\ns off\nusemtl gold\nf -4 -3 \\\n -2\n",
        "part.obj", &said);
    CHECK(mesh.vertices.size() == 4);
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}});
    CHECK(mesh.triangle_attributes.at(0).values == std::vector<double>{0, 0, 1});
    CHECK(said.dropped == std::vector<std::string>{"1 normals", "1 texture coordinates",
                                                   "name of material 1: gold", "name of material 0: steel"});
}

TEST_CASE("every material name of an OBJ file gets an id of its own", "[foreign]") {
    const auto ids_of = [](const std::vector<std::string>& names) {
        std::string text = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
        for (const std::string& name : names) text += "usemtl " + name + "\nf 1 2 3\n";
        return decode_obj(text, "part.obj").triangle_attributes.at(0).values;
    };
    CHECK(ids_of({"material_2", "Si", "SiO2"}) == std::vector<double>{2, 0, 1});
    CHECK(ids_of({"Si", "SiO2", "Si", "material_0"}) == std::vector<double>{1, 2, 1, 0});
    CHECK(ids_of({"material_1", "material_01", "Ti", "material_x"}) == std::vector<double>{1, 0, 2, 3});
    // Faces before the first usemtl get a separate id.
    const TriangleMesh mesh =
        decode_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nusemtl Si\nf 1 2 3\n", "part.obj");
    CHECK(mesh.triangle_attributes.at(0).values == std::vector<double>{0, 1});
}
