#include "levelset/meshes/volume.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "levelset/layers/make_stack.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kDx = 0.1;

// Volume of a body above a wafer whose top lies at z = -2.
double volume_above(const Domain& domain, const Shape& body) {
    const MaterialStack stack = make_stack(domain, {{0, {.kind = ShapeKind::plane, .top = -2.0}}, {1, body}});
    return volume_of(stack, 1) - volume_of(stack, 0);
}

}  // namespace

TEST_CASE(
    "volumes of spheres and cylinders are right to 1e-4 at ten cells a radius, wherever they lie on the grid") {
    const Domain domain = make_domain({4.0, 2.4}, kDx, {Side::reflective, Side::periodic});
    for (const double off : {0.0, 0.13, 0.4, 0.5}) {
        CAPTURE(off);
        const double at = off * kDx;
        CHECK(volume_above(
                  domain, {.kind = ShapeKind::sphere, .position = {at, at}, .radius = 1.0, .centre_z = at}) ==
              Approx(4.0 / 3.0 * std::numbers::pi).epsilon(1e-4));
        CHECK(volume_above(domain, {.kind = ShapeKind::cylinder,
                                    .position = {at, 0.0},
                                    .radius = 1.0,
                                    .centre_z = at,
                                    .axis = 1}) == Approx(std::numbers::pi * 2.4).epsilon(1e-4));
    }
}

TEST_CASE("the volume between plane faces is that of the mesh, which has their edges") {
    const Domain domain = make_domain({4.0, 4.0}, kDx, {Side::reflective, Side::reflective});
    for (const double off : {0.13, 0.4, 0.5}) {
        CAPTURE(off);
        const double width = 2.0 + off * kDx;
        CHECK(volume_above(domain, {.kind = ShapeKind::fin, .top = -2.0, .width = width, .height = 1.0}) ==
              Approx(4.0 * width).epsilon(1e-4));
    }
}
