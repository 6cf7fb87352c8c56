#include "surface/mesh_io.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "meshes.hpp"
#include "surface/error.hpp"

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

TEST_CASE("a mesh written as VTP reads back to the last bit, attributes and units included") {
    const TriangleMesh mesh = decorated_mesh();
    const MeshMetadata said{{{"length_unit", "um"}, {"note", "a < b & \"c\""}}, {{"time", 0.1}}};
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

TEST_CASE("a VTP array longer than one compressed block reads back to the last bit") {
    const TriangleMesh mesh = test::torus_mesh(150, 1.0, 0.3);
    require_same_shape(mesh, decode_vtp(encode_vtp(mesh), "memory"));
}

TEST_CASE("the same mesh gives the same file bytes") {
    const TriangleMesh mesh = decorated_mesh();
    CHECK(encode_vtp(mesh) == encode_vtp(decorated_mesh()));
    CHECK(encode_ply(mesh) == encode_ply(decorated_mesh()));
}

TEST_CASE("a mesh written as PLY reads back to the last bit, components as properties of their own") {
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

TEST_CASE("every dialect of VTP holds the same surface") {
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

TEST_CASE("ascii, little and big endian PLY hold the same surface") {
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

TEST_CASE("an attribute of the wrong length is refused before anything is written") {
    TriangleMesh mesh = test::plane_mesh(1);
    mesh.triangle_attributes.push_back({"flux", 1, Scalar::float64, {1.0}});
    const auto path = scratch("never.vtp");
    std::filesystem::remove(path);
    CHECK_THROWS_AS(write_mesh(path, mesh), GeometryError);
    CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("a mesh that cannot be written is an i/o error and leaves nothing behind") {
    const auto blocker = scratch("blocker");
    std::ofstream(blocker) << "a file, not a folder";
    CHECK_THROWS_AS(write_mesh(blocker / "mesh.vtp", test::plane_mesh(1)), IoError);
    const auto folder = scratch("folder.vtp");
    std::filesystem::create_directories(folder);
    CHECK_THROWS_AS(write_mesh(folder, test::plane_mesh(1)), IoError);
    CHECK_FALSE(std::filesystem::exists(folder.string() + ".partial"));
}
