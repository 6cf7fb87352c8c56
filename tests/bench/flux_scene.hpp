#pragma once
#include <string>
#include <utility>
#include <vector>

#include "flux/tracer/tracer.hpp"
#include "tests/bench/measure.hpp"
#include "tests/bench/study_surfaces.hpp"

// Scenes for the flux benchmarks.
namespace sidewall::bench {

/// A surface between mirrors, ready to be traced.
struct Scene {
    std::string name;
    TriangleMesh mesh;
    surface::RayScene scene;
    flux::LateralBox box;
    flux::Wedges wedges;
    double spacing;
    Scene(std::string label, TriangleMesh surface, double dx)
        : name(std::move(label)),
          mesh(std::move(surface)),
          scene(mesh),
          box(flux::lateral_box(mesh, {flux::Boundary::reflective, flux::Boundary::reflective})),
          wedges(flux::make_wedges(mesh)),
          spacing(dx) {}
    flux::FluxResult trace(double sticking, std::uint64_t rays, std::uint64_t seed = 1) const {
        return flux::trace_flux(mesh, scene, box, {"bench", 1.0, {sticking}}, {}, wedges,
                                {.rays = rays, .seed = seed});
    }
};

/// Scenes of the meshes named MESH=GRID_SPACING, or of the study's surfaces.
inline std::vector<Scene> make_scenes(const std::vector<std::string>& words) {
    std::vector<Scene> scenes;
    const auto add = [&](StudySurface surface) {
        fmt::print("{}: {} vertices, {} triangles, dx {}\n", surface.name, surface.mesh.vertices.size(),
                   surface.mesh.triangles.size(), surface.spacing);
        scenes.emplace_back(std::move(surface.name), std::move(surface.mesh), surface.spacing);
    };
    for (StudySurface& surface : surfaces_of(words)) add(std::move(surface));
    return scenes;
}

}  // namespace sidewall::bench
