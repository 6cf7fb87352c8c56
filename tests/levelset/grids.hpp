#pragma once
#include <cmath>
#include <functional>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/motion/advection.hpp"
#include "levelset/redistance.hpp"

// Level sets with known fronts, in grid spacings (dx = 1).
namespace sidewall::test {

using levelset::Side;

inline levelset::Domain unit_domain(int cells, Side side = Side::reflective) {
    return levelset::make_domain({double(cells), double(cells)}, 1.0, {side, side});
}

inline levelset::GridPtr sphere_grid(const levelset::Domain& domain, double radius,
                                     const Vec3& centre = Vec3::Zero()) {
    return levelset::sample_grid(
        domain, [=](const Vec3& p) { return (p - centre).norm() - radius; }, centre.z() - radius - 4,
        centre.z() + radius + 4);
}

/// Mean, standard deviation and largest absolute value of |p| - radius over the vertices.
struct RadiusError {
    double mean = 0, deviation = 0, max = 0;
};

inline RadiusError radius_error(const TriangleMesh& mesh, double radius) {
    RadiusError e;
    double squares = 0;
    for (const Vec3& p : mesh.vertices) {
        const double d = p.norm() - radius;
        e.mean += d;
        squares += d * d;
        e.max = std::max(e.max, std::abs(d));
    }
    const auto n = static_cast<double>(mesh.vertices.size());
    e.mean /= n;
    e.deviation = std::sqrt(std::max(0.0, squares / n - e.mean * e.mean));
    return e;
}

/// Volume between z = 0 and the front, positive above z = 0 and negative below.
inline double volume_above_zero(const levelset::Grid& grid, const levelset::Domain& domain,
                                surface::SharpEdges edges = surface::SharpEdges::none) {
    const TriangleMesh mesh = levelset::extract_surface(grid, domain, edges);
    double sum = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
    return sum;
}

/// The motion of a time step, from the extension of the stack's surface and a speed law on its samples.
inline levelset::Motion motion_of(const levelset::MaterialStack& stack, levelset::Extension extension,
                                  levelset::SpeedLaw law) {
    levelset::find_bodies(stack, extension);
    return {std::move(extension), std::move(law)};
}

/// Moves the stack's surface for \p duration under \p speed(layer, normal), in time steps of at most cfl dx.
/// \param max_etch_rate  largest etch rate of each layer, where the speed depends on the normal; else empty.
inline void move(levelset::MaterialStack& stack, double duration, const levelset::AdvectionOptions& options,
                 const std::function<double(std::size_t layer, const Vec3& normal)>& speed,
                 const std::vector<double>& max_etch_rate = {}) {
    for (double time = 0.0; time < duration - 1e-12;) {
        const auto motion = motion_of(
            stack, levelset::extend_untraced(stack, nullptr, false),
            {.speed = [&](std::size_t, std::size_t layer, const Vec3& n) { return speed(layer, n); },
             .depends_on_normal = !max_etch_rate.empty(),
             .max_etch_rate = [&](std::size_t, std::size_t layer) { return max_etch_rate[layer]; }});
        const double fastest = levelset::max_speed(stack, motion);
        const double left = duration - time;
        const double time_steps =
            std::ceil(left * fastest / (options.cfl * stack.domain.spacing) * (1.0 - 1e-9));
        const double dt = left / std::max(1.0, time_steps);
        levelset::advect(stack, motion, dt, options);
        time += dt;
    }
}

}  // namespace sidewall::test
