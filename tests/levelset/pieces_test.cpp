#include "levelset/meshes/pieces.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "levelset/layers/stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

std::vector<SurfacePiece> pieces_of(const Domain& domain, const std::function<double(const Vec3&)>& phi) {
    return surface_pieces(extract_surface(*sample_grid(domain, phi, -16.0, 16.0), domain), domain);
}

// A wafer with its surface at z = 0.3.
double wafer(const Vec3& p) {
    return p.z() - 0.3;
}

// A bar along y around (\p x, \p z), of half-widths \p a in x and \p b in z.
double bar(const Vec3& p, double x, double z, double a, double b) {
    return std::max(std::abs(p.x() - x) - a, std::abs(p.z() - z) - b);
}

}  // namespace

TEST_CASE("what hangs and what is shut in is told by the pieces of a surface") {
    const auto side = GENERATE(Side::reflective, Side::periodic);
    const Domain domain = make_domain({24.0, 12.0}, 1.0, {side, Side::periodic});
    SECTION("a wafer's surface lies across the domain and is neither") {
        const auto pieces = pieces_of(domain, wafer);
        REQUIRE(pieces.size() == 1);
        CHECK(pieces[0].cover == 1);
        CHECK_FALSE(pieces[0].hangs());
        CHECK_FALSE(pieces[0].shuts_in());
    }
    SECTION("a bar from one side to the other hangs, one that stands does not, also where a side cuts it") {
        for (const double x : {0.0, 12.0}) {
            const auto bar_at = [&](double z) {
                return pieces_of(domain, [&, z](const Vec3& p) {
                    double other = x > 0.0 && side == Side::periodic ? bar(p, x - 24.0, z, 4.2, 1.2) : 1e9;
                    return std::min({wafer(p), bar(p, x, z, 4.2, 1.2), other});
                });
            };
            CHECK(bar_at(1.0).size() == 1);
            const auto pieces = bar_at(6.4);
            REQUIRE(pieces.size() == 2);
            const SurfacePiece& piece = pieces[0].cover == 0 ? pieces[0] : pieces[1];
            CHECK(piece.hangs());
            CHECK_FALSE(piece.shuts_in());
            const double share = x > 0.0 && side == Side::reflective ? 0.5 : 1.0;
            CHECK(piece.volume == Approx(share * 8.4 * 2.4 * 12.0).epsilon(0.05));  // corners cut off
            CHECK(piece.boxes.size() == (x > 0.0 && side == Side::periodic ? 2 : 1));
        }
    }
    SECTION("a closed void is gas, of its volume") {
        const auto pieces = pieces_of(domain, [](const Vec3& p) {
            return std::max(wafer(p), 4.2 - (p - Vec3(0.0, 0.0, -8.1)).norm());
        });
        REQUIRE(pieces.size() == 2);
        const SurfacePiece& piece = pieces[0].cover == 0 ? pieces[0] : pieces[1];
        CHECK(piece.shuts_in());
        CHECK_FALSE(piece.hangs());
        CHECK(-piece.volume == Approx(4.0 / 3.0 * std::numbers::pi * std::pow(4.2, 3)).epsilon(0.04));
    }
    SECTION("a sheet across the whole domain hangs and shuts in what is below it") {
        const auto pieces =
            pieces_of(domain, [](const Vec3& p) { return std::min(wafer(p), std::abs(p.z() - 6.4) - 1.2); });
        REQUIRE(pieces.size() == 3);
        int covers = 0;
        for (const SurfacePiece& piece : pieces) {
            covers += piece.cover;
            CHECK(piece.hangs() == (piece.cover < 0));
            CHECK(piece.shuts_in() == (piece.cover < 0));
        }
        CHECK(covers == 1);
    }
}

TEST_CASE("what is left of a layer is counted until it is enough, from where it was found") {
    const Domain domain = make_domain({24.0, 12.0}, 1.0, {Side::reflective, Side::periodic});
    const auto stack_with = [&](double thickness) {
        Shape film, base;
        base.top = 0.1;
        film.top = 0.1 + thickness;
        return make_stack(domain, {{0, base}, {1, film}});
    };
    const double area = 24.0 * 12.0, all = 1e9;
    std::size_t start = 12345;
    CHECK(volume_left(stack_with(0.0), 1, all, start) == 0.0);
    CHECK(volume_left(stack_with(0.01), 1, all, start) == 0.0);  // thinner than kExposed: counts as none
    for (const double thickness : {0.1, 0.3, 0.7})
        CHECK(volume_left(stack_with(thickness), 1, all, start) == Approx(thickness * area).epsilon(0.01));
    const double some = volume_left(stack_with(0.3), 1, 0.01 * area, start);
    CHECK(some >= 0.01 * area);
    CHECK(some < 0.3 * area);
    // A bar in the domain's far half is found wherever the search begins.
    Shape base, bar;
    bar.kind = ShapeKind::box;
    bar.size = {5.0, 7.0};
    bar.position = {8.0, 1.0};
    bar.height = 1.3;
    const MaterialStack stack = make_stack(domain, {{0, base}, {1, bar}});
    for (const std::size_t from : {0, 1, 2}) {
        std::size_t begin = from;
        CHECK(volume_left(stack, 1, all, begin) == Approx(5.0 * 7.0 * 1.3).epsilon(0.1));
    }
}

TEST_CASE(
    "buried layers of which less than a cell is left go, films too thin for the grid stay for their volume") {
    const Domain domain = make_domain({24.0, 12.0}, 1.0, {Side::reflective, Side::periodic});
    Shape base, spent, film, top;
    base.top = spent.top = 0.1;
    film.top = 0.1 + 0.03;
    top.top = 2.0;
    MaterialStack stack = make_stack(domain, {{0, base}, {1, spent}, {2, film}, {3, top}});
    const double area = 24.0 * 12.0;
    const std::vector<double> volumes = {0.1 * area, 0.0, 0.03 * area, 1.87 * area};
    CHECK(drop_spent_layers(stack, volumes));
    REQUIRE(stack.layers.size() == 3);
    for (std::size_t k = 0; k < 3; ++k) CHECK(stack.layers[k].material == std::vector{0, 2, 3}[k]);
    CHECK_FALSE(drop_spent_layers(stack, std::vector{0.1 * area, 0.03 * area, 1.87 * area}));
    // The substrate and the top layer stay, even without volume.
    MaterialStack two = make_stack(domain, {{0, base}, {1, spent}});
    CHECK_FALSE(drop_spent_layers(two, std::vector{0.0, 0.0}));
}
