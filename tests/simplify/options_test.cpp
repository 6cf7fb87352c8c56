// The rows below set some options by name; the others keep their defaults on purpose.
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include "simplify/simplify.hpp"

#include <limits>

#include "checks.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::test;
using simplify::Method;
using simplify::Options;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TriangleMesh square_and(const std::function<void(TriangleMesh&)>& damage) {
    TriangleMesh mesh = square_mesh(2, 1.0);
    damage(mesh);
    return mesh;
}

std::vector<std::uint8_t> no_features(const TriangleMesh& mesh) {
    return std::vector<std::uint8_t>(mesh.vertices.size(), 0);
}

}  // namespace

TEST_CASE("method names survive a round trip") {
    for (const Method m : {Method::none, Method::lindstrom_turk, Method::region, Method::cgal_lindstrom_turk,
                           Method::region_bounded})
        CHECK(simplify::method_from_string(to_string(m)) == m);
    CHECK(to_string(Method::lindstrom_turk) == "lindstrom-turk");
    CHECK_THROWS_WITH(simplify::method_from_string("regions"), Catch::Contains("lindstrom-turk"));
}

TEST_CASE("options out of range are refused by name") {
    const TriangleMesh mesh = square_mesh(4, 1.0);
    struct Row {
        Options options;
        const char* says;
    };
    const double inf = std::numeric_limits<double>::infinity();
    const Row rows[] = {
        {{.l0 = -1.0}, "simplify.l0 = -1"},
        {{.l0 = kNan}, "simplify.l0"},
        {{.l0 = inf}, "simplify.l0"},
        {{.step = 0.0}, "simplify.step"},
        {{.step = -0.1}, "simplify.step"},
        {{.step = kNan}, "simplify.step"},
        {{.l_max = -2.0}, "simplify.l_max"},
        {{.l_max = kNan}, "simplify.l_max"},
        {{.target_vertices = 0}, "simplify.target_vertices"},
        {{.weights = simplify::Weights{-0.1, 0.5, 0.5}}, "volume = -0.1"},
        {{.weights = simplify::Weights{0.5, kNan, 0.5}}, "boundary"},
        {{.weights = simplify::Weights{0.5, 0.5, inf}}, "shape"},
        {{.weights = simplify::Weights{0.0, 0.5, 0.0}}, "volume and shape"},
        {{.method = Method::cgal_lindstrom_turk, .max_error = 0.1}, "max_error"},
        {{.max_error = 0.0}, "simplify.max_error"},
        {{.max_error = kNan}, "simplify.max_error"},
        {{.grid_spacing = 0.0}, "grid_spacing"},
        {{.grid_spacing = kNan}, "grid_spacing"},
        {{.method = Method::lindstrom_turk, .l_max = -1.0}, "simplify.l_max"},
        {{.method = Method::lindstrom_turk, .target_vertices = 0}, "simplify.target_vertices"},
    };
    for (const Row& row : rows) {
        INFO(row.says);
        CHECK_THROWS_AS(simplify::simplify(mesh, no_features(mesh), row.options), RecipeError);
        CHECK_THROWS_WITH(simplify::simplify(mesh, no_features(mesh), row.options),
                          Catch::Contains(row.says));
    }
}

TEST_CASE("meshes that cannot be simplified are refused with the place") {
    struct Row {
        TriangleMesh mesh;
        const char* says;
    };
    const Row rows[] = {
        {square_and([](auto& m) { m.vertices[4].z() = kNan; }), "vertex 4 is not finite"},
        {square_and([](auto& m) { m.vertices[3].x() = std::numeric_limits<double>::infinity(); }),
         "vertex 3"},
        {square_and([](auto& m) { m.vertices[0].x() = -1.7e308, m.vertices[8].x() = 1.7e308; }), "too large"},
        {square_and([](auto& m) { m.triangles[1][0] = 99; }), "triangle 1 names vertex 99"},
        {square_and([](auto& m) { m.triangles[2][0] = m.triangles[2][1]; }), "triangle 2 uses vertex"},
        {square_and([](auto& m) { m.triangles.push_back(m.triangles[0]); }), "duplicate triangles"},
        {square_and([](auto& m) {
             m.vertices.emplace_back(0.5, 0.5, 1.0);
             m.triangles.push_back({4, 0, 9});
         }),
         "has 3 triangles"},
        {square_and([](auto& m) { std::swap(m.triangles[3][0], m.triangles[3][1]); }), "oriented against"},
        {square_and([](auto& m) {
             m.vertices.emplace_back(3, 3, 0), m.vertices.emplace_back(2, 3, 0);
             m.triangles.push_back({8, 9, 10});
         }),
         "vertex 8"},
        {square_and([](auto& m) {
             m.triangle_attributes.push_back({"material", 1, Scalar::int32, {1.0}});
         }),
         "attribute `material` has 1 values"},
        {square_and([](auto& m) {
             m.triangle_attributes.push_back({"material", 1, Scalar::int32, std::vector<double>(8, kNan)});
         }),
         "attribute `material` of triangle 0"},
    };
    for (const Row& row : rows)
        for (const Method method :
             {Method::region, Method::region_bounded, Method::lindstrom_turk, Method::cgal_lindstrom_turk}) {
            INFO(row.says);
            const Options options{.method = method, .step = 1.0, .l_max = 3.0};
            CHECK_THROWS_AS(simplify::simplify(row.mesh, no_features(row.mesh), options), GeometryError);
            CHECK_THROWS_WITH(simplify::simplify(row.mesh, no_features(row.mesh), options),
                              Catch::Contains(row.says));
        }
    const TriangleMesh mesh = square_mesh(4, 1.0);
    const std::vector<std::uint8_t> short_flags(3, 0);
    CHECK_THROWS_AS(simplify::simplify_regions(mesh, short_flags, {.l0 = 1.0, .step = 1.0, .l_max = 1.0}),
                    GeometryError);
    CHECK_THROWS_AS(simplify::simplify(mesh, short_flags, {}), GeometryError);
}

TEST_CASE("auto is the grid spacing, else the mean edge between features, else of all edges") {
    const TriangleMesh mesh = square_mesh(4, 2.0);
    std::vector<std::uint8_t> features = no_features(mesh);
    CHECK(simplify::base_length(mesh, features, 0.7) == 0.7);
    CHECK(simplify::base_length(mesh, features, {}) == Approx(2.0 * (2.0 + std::sqrt(2.0)) / 3.0));
    features[0] = features[1] = 1;
    CHECK(simplify::base_length(mesh, features, {}) == Approx(2.0));

    const simplify::Options region = simplify::resolve({.l0 = 0.0}, 0.5);
    CHECK(region.l0 == 0.0);
    CHECK(region.step == 0.5);
    CHECK(region.l_max == 1.5);
}

TEST_CASE("the dispatcher runs each method and names what it dropped") {
    TriangleMesh mesh = square_mesh(10, 1.0);
    mesh.vertex_attributes.push_back({"coverage", 1, Scalar::float64, std::vector<double>(121, 0.5)});
    mesh.triangle_attributes.push_back({"material", 1, Scalar::int32, std::vector<double>(200, 3.0)});
    const auto features = no_features(mesh);

    const auto untouched = simplify::simplify(mesh, {}, {.method = Method::none});
    CHECK(same_bits(untouched.mesh, mesh));
    CHECK(untouched.dropped_attributes.empty());
    for (const Method method :
         {Method::lindstrom_turk, Method::cgal_lindstrom_turk, Method::region, Method::region_bounded}) {
        const auto result = simplify::simplify(mesh, features, {.method = method});
        CHECK(result.mesh.vertices.size() < 121);
        CHECK(result.dropped_attributes == std::vector<std::string>{"coverage"});
        REQUIRE(result.mesh.triangle_attribute("material"));
        CHECK(result.mesh.triangle_attribute("material")->values ==
              std::vector<double>(result.mesh.triangles.size(), 3.0));
        CHECK(result.seconds.collapse <= result.seconds.total);
    }
    CHECK(simplify::simplify({}, {}, {}).mesh.vertices.empty());
}
