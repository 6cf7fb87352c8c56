#pragma once
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "flux/radiosity/method_choice.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {

/// Sides of a profile: in a mesh one row wide, rays fly in the plane of x and z.
inline constexpr std::array kProfile{Boundary::reflective, Boundary::periodic};

/// A surface with all that radiosity needs, and exchanges gathered on it.
struct Cavity {
    TriangleMesh mesh;
    std::vector<std::int32_t> materials;
    LateralBox box;
    surface::RayScene scene;
    Wedges wedges;
    Cavity(TriangleMesh surface, std::array<Boundary, 2> boundary, std::vector<std::int32_t> ids = {})
        : mesh(std::move(surface)),
          materials(std::move(ids)),
          box(lateral_box(mesh, boundary)),
          scene(mesh),
          wedges(make_wedges(mesh, materials)) {}
    Exchange gathered(std::uint64_t rays_of_unknown, std::uint64_t seed = 1,
                      std::vector<double> exponents = {1.0}) const {
        Exchange exchange(mesh, scene, box, wedges, std::move(exponents), {.seed = seed});
        if (rays_of_unknown > 0) exchange.gather(rays_of_unknown * wedges.count());
        return exchange;
    }
    std::vector<double> sticking(std::vector<double> by_material) const {
        return sticking_by_wedge(wedges, materials, {.sticking = std::move(by_material)});
    }
};

}  // namespace sidewall::flux
