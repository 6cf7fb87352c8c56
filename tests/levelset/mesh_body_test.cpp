#include "levelset/shapes/mesh_body.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <tuple>

#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/winding_number.hpp"
#include "tests/folder.hpp"
#include "tests/surface/surface_meshes.hpp"

// Bodies from meshes of other programs, compared with distances known without the mesh.
using namespace sidewall;
using namespace sidewall::levelset;
using Catch::Matchers::Contains;
using sidewall::test::Folder, sidewall::test::joined, sidewall::test::soup;

namespace {

const Domain kDomain = make_domain({4.0, 4.0}, 0.1, {Side::reflective, Side::reflective});

// A box from \p low to \p high with outward normals; the last two triangles are its top.
TriangleMesh box(const Vec3& low, const Vec3& high) {
    TriangleMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.vertices.emplace_back((k & 1) != 0 ? high.x() : low.x(), (k & 2) != 0 ? high.y() : low.y(),
                                   (k & 4) != 0 ? high.z() : low.z());
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                      {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}, {4, 5, 6}, {5, 7, 6}};
    return mesh;
}

void turn(TriangleMesh& mesh) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

// The signed distance from a box.
double from_box(const Vec3& p, const Vec3& low, const Vec3& high) {
    const Vec3 q = (low - p).cwiseMax(p - high);
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

Body body_of(const TriangleMesh& mesh, const Domain& domain = kDomain) {
    const Folder folder;
    Shape shape{.kind = ShapeKind::mesh, .file = (folder.path / "body.vtp").string()};
    surface::write_mesh(shape.file, mesh);
    return mesh_body(shape, domain);
}

std::string mended(const TriangleMesh& mesh) {
    const Folder folder;
    surface::write_mesh(folder.path / "body.vtp", mesh);
    return surface::repair_summary(import_mesh((folder.path / "body.vtp").string(), kDomain).repairs);
}

// Checks distances at random points; \p slack allows for the contact distance, 1e-3 dx, that joins bodies.
void check(const Body& body, const std::function<double(const Vec3&)>& expected, double slack = 1.1e-4) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(-1.99, 1.99);
    for (int i = 0; i < 3000; ++i) {
        const Vec3 p(place(random), place(random), place(random));
        INFO(p.transpose());
        REQUIRE(std::abs(body.distance(p) - expected(p)) <= slack);
    }
}

const Vec3 kLow(-1, -1, -0.5), kHigh(0.5, 0.5, 1), kLow2(-0.5, -0.5, -0.5), kHigh2(1, 1, 1);

double box_distance(const Vec3& p) {
    return from_box(p, kLow, kHigh);
}

}  // namespace

TEST_CASE("a sound body keeps its bits, and one of turned, loose or repeated triangles is mended to it") {
    const TriangleMesh sound = box(kLow, kHigh);
    CHECK(mended(sound).empty());
    check(body_of(sound), box_distance, 1e-12);
    TriangleMesh inverted = sound, one = sound, some = sound, twice = sound;
    turn(inverted);
    std::swap(one.triangles[3][0], one.triangles[3][1]);
    for (const std::size_t t : {0, 4, 5, 9}) std::swap(some.triangles[t][1], some.triangles[t][2]);
    twice.triangles.insert(twice.triangles.end(), inverted.triangles.begin(), inverted.triangles.end());
    for (const TriangleMesh& mesh :
         {inverted, one, some, twice, soup(sound), soup(inverted), soup(one), soup(some), soup(twice)})
        check(body_of(mesh), box_distance, 1e-12);
    CHECK(mended(inverted) == "the surface was inside out: all 12 triangles were turned over");
    CHECK_THAT(mended(one), Contains("1 of 12 triangles were turned over"));
    CHECK_THAT(mended(soup(sound)), Contains("28 vertices of the same position as another were merged"));
}

TEST_CASE("bodies that overlap, touch or lie in each other are united") {
    const TriangleMesh first = box(kLow, kHigh), second = box(kLow2, kHigh2);
    const auto both = [](const Vec3& p) { return std::min(box_distance(p), from_box(p, kLow2, kHigh2)); };
    check(body_of(joined({first, second})), both);
    TriangleMesh turned = second;
    turn(turned);
    check(body_of(joined({first, turned})), both);
    check(body_of(soup(joined({first, second}))), both);
    // One inside the other: the inner one has no effect.
    check(body_of(joined({first, box(Vec3(-0.7, -0.7, -0.3), Vec3(0, 0, 0.5))})), box_distance);
    // Boxes that share a whole face, as two bodies and as loose triangles, make one block; inside it only the
    // sign counts.
    const Vec3 far(1.5, 0.5, 1);
    const auto block = [&](const Vec3& p) { return from_box(p, kLow, far); };
    const TriangleMesh pair = joined({first, box(Vec3(0.5, -1, -0.5), far)});
    for (const TriangleMesh& mesh : {pair, soup(pair)}) {
        const Body body = body_of(mesh);
        for (const double x : {-0.9, 0.4, 0.4999, 0.5, 0.5001, 0.6, 1.4})
            CHECK(body.distance(Vec3(x, 0, 0.2)) < 0.0);
        for (const double z : {-0.6, 1.1})
            for (const double x : {-0.9, 0.5, 1.4})
                CHECK(body.distance(Vec3(x, 0, z)) == Approx(block(Vec3(x, 0, z))).margin(2e-4));
    }
}

TEST_CASE("a body that overlaps or touches itself is material wherever it winds around") {
    // Two blocks that overlap over (-1, -1) to (0.5, 0), welded along an edge in common into one piece.
    const Vec3 low2(-1, -1, -0.5), high2(1, 0, 1);
    // A block on a block, the shared squares split along different diagonals: inner walls remain.
    const Vec3 low3(-1, -1, 1), high3(0.5, 0.5, 1.5);
    TriangleMesh upper = box(low3, high3);
    upper.triangles[0] = {0, 2, 3};
    upper.triangles[1] = {0, 3, 1};
    for (const auto& [other, low, high] :
         {std::tuple(box(low2, high2), low2, high2), std::tuple(upper, low3, high3)}) {
        const Body body = body_of(soup(joined({box(kLow, kHigh), other})));
        std::mt19937 random(11);
        std::uniform_real_distribution<double> place(-1.9, 1.9);
        for (int i = 0; i < 3000; ++i) {
            const Vec3 p(place(random), place(random), place(random));
            const double expected = std::min(box_distance(p), from_box(p, low, high));
            INFO(p.transpose());
            if (expected > 0.0)
                REQUIRE(body.distance(p) == Approx(expected).margin(1e-12));
            else
                REQUIRE(body.distance(p) < 0.0);
        }
        for (const Vec3& wall : {Vec3(0.5, -0.5, 0), Vec3(0, 0, 0.25), Vec3(-0.25, -0.25, 1)})
            if (from_box(wall, low, high) + box_distance(wall) < 0.0) CHECK(body.distance(wall) < 0.0);
    }
}

TEST_CASE("a mesh winds around points inside once, outside never, and twice where bodies overlap") {
    TriangleMesh ball;  // 20 x 40 squares
    for (int i = 0; i <= 20; ++i)
        for (int j = 0; j < 40; ++j) {
            const double theta = 3.14159265358979 * i / 20, phi = 6.28318530717959 * j / 40;
            ball.vertices.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                       -std::cos(theta));
        }
    for (std::uint32_t i = 0; i < 20; ++i)
        for (std::uint32_t j = 0; j < 40; ++j) {
            const std::uint32_t a = 40 * i + j, b = 40 * i + (j + 1) % 40;
            ball.triangles.push_back({a, b, b + 40});
            ball.triangles.push_back({a, b + 40, a + 40});
        }
    const surface::WindingNumber one(ball), both(joined({ball, box(Vec3(0, 0, 0), Vec3(2, 2, 2))}));
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-2, 2);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 p(place(random), place(random), place(random));
        if (std::abs(p.norm() - 1.0) < 0.02) continue;  // between the ball and its triangles
        const double inside = p.norm() < 1.0 ? 1.0 : 0.0, block = p.minCoeff() > 0.0 ? 1.0 : 0.0;
        INFO(p.transpose());
        REQUIRE(one.at(p) == Approx(inside).margin(0.02));
        REQUIRE(both.at(p) == Approx(inside + block).margin(0.02));
    }
}

TEST_CASE("a cavity stays gas, a body in it stays material, and one below an overhang is turned outwards") {
    const Vec3 outer(1.5, 1.5, 1.5), inner(1, 1, 1), core(0.5, 0.5, 0.5);
    TriangleMesh cavity = box(-inner, inner);
    turn(cavity);
    check(body_of(joined({box(-outer, outer), cavity, box(-core, core)})), [&](const Vec3& p) {
        return std::min(std::max(from_box(p, -outer, outer), -from_box(p, -inner, inner)),
                        from_box(p, -core, core));
    });
    // The lower box, inside out, lies in the shadow of the upper one, in gas.
    TriangleMesh hidden = box(Vec3(-0.5, -0.5, -1), Vec3(0.5, 0.5, -0.5));
    turn(hidden);
    check(body_of(joined({box(Vec3(-1, -1, 0), Vec3(1, 1, 1)), hidden})), [](const Vec3& p) {
        return std::min(from_box(p, Vec3(-1, -1, 0), Vec3(1, 1, 1)),
                        from_box(p, Vec3(-0.5, -0.5, -1), Vec3(0.5, 0.5, -0.5)));
    });
}

TEST_CASE("small openings are closed, those in the domain's sides are not, and large ones are refused") {
    TriangleMesh open = box(kLow, kHigh);
    open.triangles.pop_back();
    CHECK(mended(open) == "1 openings were closed");
    check(body_of(open), box_distance, 1e-12);
    open.triangles.pop_back();  // without its top: 1.5 x 1.5 of an area of 13.5
    check(body_of(open), box_distance, 1e-12);
    // A bar from side to side without end faces: its other faces, in x and z, define it.
    TriangleMesh line = box(Vec3(-0.5, -2, 0), Vec3(0.5, 2, 1));
    line.triangles.erase(line.triangles.begin() + 2, line.triangles.begin() + 6);
    CHECK(mended(line).empty());
    check(
        body_of(line), [](const Vec3& p) { return from_box(p, Vec3(-0.5, -9, 0), Vec3(0.5, 9, 1)); }, 1e-12);
    // A block over an edge of the domain, without the faces in its two sides. Its upper face, all of whose
    // corners lie on sides, is missing in a bar from side to side.
    TriangleMesh corner = box(Vec3(-2, -2, 0), Vec3(-0.5, -0.5, 1));
    corner.triangles.erase(corner.triangles.begin() + 6, corner.triangles.begin() + 8);
    corner.triangles.erase(corner.triangles.begin() + 2, corner.triangles.begin() + 4);
    CHECK(mended(corner).empty());
    check(
        body_of(corner), [](const Vec3& p) { return from_box(p, Vec3(-9, -9, 0), Vec3(-0.5, -0.5, 1)); },
        1e-12);
    TriangleMesh bar = box(Vec3(-0.5, -2, -1), Vec3(0.5, 2, 1));
    bar.triangles.resize(10);
    CHECK(mended(bar) == "1 openings were closed");
    TriangleMesh flat;  // does not reach the sides
    flat.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    flat.triangles = {{0, 1, 2}, {0, 2, 3}};
    CHECK_THROWS_WITH(mended(flat), Contains("around (0, 0, 0) it has an opening, 1 of its area"));
}

TEST_CASE(
    "a closed body that reaches over periodic sides goes on at the opposite ones, with the cavity in it") {
    const Domain both = make_domain({4.0, 4.0}, 0.1, {Side::periodic, Side::periodic}),
                 along_x = make_domain({4.0, 4.0}, 0.1, {Side::periodic, Side::reflective});
    const Vec3 low(1.5, 1.7, -0.5), high(2.6, 2.4, 0.5), inner(0.1, 0.1, 0.1);
    TriangleMesh cavity = box(low + inner, high - inner);
    turn(cavity);
    const TriangleMesh mesh = joined({box(low, high), cavity});
    const auto expected = [&](const Domain& domain) {
        return [&](const Vec3& p) {
            double least = 1e9;
            for (const double x : {0.0, -4.0})
                for (const double y :
                     domain.side[1] == Side::periodic ? std::vector{0.0, -4.0} : std::vector{0.0}) {
                    const Vec3 q = p - Vec3(x, y, 0);
                    least = std::min(
                        least, std::max(from_box(q, low, high), -from_box(q, low + inner, high - inner)));
                }
            return least;
        };
    };
    for (const Domain& domain : {both, along_x}) {
        const Body body = body_of(mesh, domain);
        const auto truth = expected(domain);
        for (double x = -1.97; x < 2.0; x += 0.1)
            for (double y = -1.93; y < 2.0; y += 0.1)
                for (const double z : {-0.45, 0.03, 0.48}) {
                    INFO(x << " " << y << " " << z);
                    // Within 0.3, the band of a grid, only copies one period away matter.
                    if (std::abs(truth({x, y, z})) < 0.3)
                        REQUIRE(std::abs(body.distance({x, y, z}) - truth({x, y, z})) < 1.1e-4);
                    REQUIRE((body.distance({x, y, z}) < 0.0) == (truth({x, y, z}) < 0.0));
                }
    }
    // A wall longer than the domain is cut at its sides.
    const Vec3 left(-0.3, -5, -0.5), right(0.3, 5, 0.5);
    const Body wall = body_of(box(left, right), both);
    for (const double y : {-1.9, 0.0, 1.9}) CHECK(wall.distance({0.5, y, 0.0}) == Approx(0.2).margin(1e-3));
}

TEST_CASE(
    "a surface over the domain has its material below, whichever way it is listed, and bodies above join it") {
    TriangleMesh trench;  // 1 wide and 1 deep
    const double x[] = {-2, -0.5, -0.5, 0.5, 0.5, 2}, z[] = {0, 0, -1, -1, 0, 0};
    for (int k = 0; k < 6; ++k)
        for (const double y : {-2.0, 2.0}) trench.vertices.emplace_back(x[k], y, z[k]);
    for (std::uint32_t k = 0; k < 5; ++k) {
        trench.triangles.push_back({2 * k, 2 * k + 2, 2 * k + 1});
        trench.triangles.push_back({2 * k + 1, 2 * k + 2, 2 * k + 3});
    }
    const auto below = [](const Vec3& p) {
        const double left = from_box(p, Vec3(-9, -9, -9), Vec3(-0.5, 9, 0)),
                     right = from_box(p, Vec3(0.5, -9, -9), Vec3(9, 9, 0)),
                     floor = from_box(p, Vec3(-9, -9, -9), Vec3(9, 9, -1));
        return std::min({left, right, floor});
    };
    const auto same_side = [&](const TriangleMesh& mesh, const std::function<double(const Vec3&)>& expected) {
        const Body body = body_of(mesh);
        std::mt19937 random(3);
        std::uniform_real_distribution<double> place(-1.9, 1.9);
        for (int i = 0; i < 3000; ++i) {
            const Vec3 p(place(random), place(random), place(random));
            INFO(p.transpose());
            REQUIRE((body.distance(p) < 0.0) == (expected(p) < 0.0));
        }
    };
    TriangleMesh inverted = trench, mixed = trench;
    turn(inverted);
    for (const std::size_t t : {1, 4, 7}) std::swap(mixed.triangles[t][1], mixed.triangles[t][2]);
    for (const TriangleMesh& mesh : {trench, inverted, mixed, soup(trench), soup(mixed)})
        same_side(mesh, below);
    // A block that stands in the trench and reaches into its floor.
    const Vec3 low(-0.25, -1, -1.5), high(0.25, 1, 0.5);
    same_side(joined({inverted, box(low, high)}),
              [&](const Vec3& p) { return std::min(below(p), from_box(p, low, high)); });
}
