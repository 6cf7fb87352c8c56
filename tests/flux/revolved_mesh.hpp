#pragma once
#include <array>
#include <utility>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/revolution.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {

/// Points r and z of a round profile's curve, from the axis outwards; material lies on its right.
using Curve = std::vector<std::array<double, 2>>;

/// The revolution of a curve out to the mirror; its straight parts are cut into pieces up to \p longest.
struct Revolved {
    TriangleMesh mesh;  // a thin sector of it
    LateralBox box;
    surface::RayScene scene;
    Wedges wedges;
    Revolved(const Curve& curve, double longest)
        : mesh(sector(curve, longest)), box(box_of(curve)), scene(mesh), wedges(make_wedges(mesh)) {
        join_rings(mesh, wedges);
    }

    static constexpr double kWidth = 0.01;
    static TriangleMesh sector(const Curve& curve, double longest);
    static LateralBox box_of(const Curve& curve) {
        LateralBox box{{0.0, -0.5 * kWidth}, {curve.back()[0], 0.5 * kWidth}, {}};
        box.boundary = {Boundary::reflective, Boundary::periodic};
        box.axial = true;
        return box;
    }
};

}  // namespace sidewall::flux
