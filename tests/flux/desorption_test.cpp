#include <catch2/catch.hpp>
#include <cmath>

#include "flux/radiosity/radiosity.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/truth.hpp"

// Particles that desorb from the surface, besides those from the source.
using namespace sidewall;
using namespace sidewall::flux;

namespace {

Species desorbing(double sticking) {
    Species species;
    species.sticking = {sticking};
    species.desorbs = true;
    return species;
}

// A trench of depth 2 cut into strips; segments 9 to 16 of 25 are its floor.
TriangleMesh desorbing_trench() {
    const std::vector<double> cuts{0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875};
    return extrude(trench_profile(2.0, 0.5, cuts, cuts), 0.5);
}

bool on_floor(const TriangleMesh& mesh, std::size_t t) {
    return triangle_centroid(mesh, t).z() < -2.0 + 1e-6;
}

std::vector<double> by_wedge(const TriangleMesh& mesh, const Wedges& wedges,
                             const std::function<double(std::size_t, const Vec3&)>& value) {
    std::vector<double> values(wedges.count(), 0.0);
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        values[wedges.corner[c]] = value(c / 3, mesh.vertices[mesh.triangles[c / 3][c % 3]]);
    return values;
}

}  // namespace

TEST_CASE("a surface that emits what it would absorb of flux 1 has flux 1 everywhere") {
    // Thermal equilibrium: Kirchhoff's law, whatever the shape and however sticking varies.
    const TriangleMesh mesh = desorbing_trench();
    const Wedges wedges = make_wedges(mesh);
    const std::vector<double> sticking = by_wedge(
        mesh, wedges, [](std::size_t, const Vec3& p) { return 0.5 + 0.4 * std::sin(3.0 * p.z() + p.x()); });
    TraceOptions options;
    options.rays = 400'000;
    options.sticking_by_wedge = sticking;
    options.emission_by_wedge = sticking;
    const FluxResult result = trace(mesh, kPeriodic, desorbing(0.5), options);
    CHECK(result.ledger.balanced());
    CHECK(result.leaked == 0);
    int far = 0;
    for (std::size_t w = 0; w < wedges.count(); ++w)
        far += std::abs(result.wedge.flux[w] - 1.0) > 3.0 * result.wedge.error[w];
    // Student's t of 31 degrees of freedom lies beyond 3 in 0.5 % of cases.
    CHECK(far <= std::max(2.0, 0.03 * static_cast<double>(wedges.count())));
    const Mean all = mean_flux(mesh, result, [](std::size_t) { return true; });
    CHECK(std::abs(all.flux - 1.0) < 4.0 * all.error);
    CHECK(all.error < 3e-3);
}

TEST_CASE("what a trench's floor emits lands as the exact view factors say, with and without sticking") {
    const TriangleMesh mesh = desorbing_trench();
    const Wedges wedges = make_wedges(mesh);
    const std::vector<double> emission =
        by_wedge(mesh, wedges, [&](std::size_t t, const Vec3&) { return on_floor(mesh, t) ? 1.0 : 0.0; });
    for (const double sticking : {1.0, 0.3}) {
        TraceOptions options;
        options.rays = 400'000;
        options.emission_by_wedge = emission;
        const FluxResult both = trace(mesh, kPeriodic, desorbing(sticking), options);
        const TrenchFlux opening = trench_flux(2.0, sticking, 200, 100),
                         floor = trench_flux(2.0, sticking, 200, 100, Emitter::floor);
        const auto wall = [&](std::size_t t) {
            return std::abs(area_vector(mesh, t).normalized().x()) > 0.5;
        };
        const Mean walls = mean_flux(mesh, both, wall);
        CHECK(std::abs(walls.flux - opening.wall_mean - floor.wall_mean) < 4.0 * walls.error + 1e-3);
        const Mean floors = mean_flux(mesh, both, [&](std::size_t t) { return on_floor(mesh, t); });
        CHECK(std::abs(floors.flux - opening.floor_mean - floor.floor_mean) < 4.0 * floors.error + 1e-3);
        for (int strip = 0; strip < 8; ++strip) {
            const double top = -0.25 * strip;
            const Mean mean = mean_flux(mesh, both, [&](std::size_t t) {
                const double z = triangle_centroid(mesh, t).z();
                return wall(t) && z < top && z > top - 0.25;
            });
            double exact = 0.0;
            for (std::size_t k = 0; k < 25; ++k) {
                const std::size_t at = 25 * static_cast<std::size_t>(strip) + k;
                exact += (opening.wall[at] + floor.wall[at]) / 25.0;
            }
            CHECK(std::abs(mean.flux - exact) < 4.0 * mean.error + 1e-3);
        }
    }
}

TEST_CASE("what desorbs is the same for any task size, traced apart from others, and refused if negative") {
    const TriangleMesh mesh = desorbing_trench();
    const Wedges wedges = make_wedges(mesh);
    std::vector<double> emission(2 * wedges.count(), 0.25);
    const std::vector<Species> species{desorbing(0.5), Species{}};
    CHECK_FALSE(same_paths(species[0], species[1]));
    CHECK(passes_of(species).size() == 2);
    TraceOptions options;
    options.rays = 20'000;
    options.emission_by_wedge = emission;
    const surface::RayScene scene(mesh);
    const LateralBox box = lateral_box(mesh, kPeriodic);
    const auto go = [&] { return trace_fluxes(mesh, scene, box, species, {}, wedges, options); };
    const auto one = go();
    options.task_rays = 4096;
    const auto other = go();
    CHECK(one[0].wedge.flux == other[0].wedge.flux);
    CHECK(one[0].ledger == other[0].ledger);
    // A species that does not desorb ignores the emission.
    options.emission_by_wedge = {};
    CHECK(go()[1].wedge.flux == one[1].wedge.flux);
    CHECK(go()[0].wedge.flux != one[0].wedge.flux);
    options.emission_by_wedge = emission;
    emission[3] = -0.1;
    CHECK_THROWS_AS(go(), RecipeError);
    emission[3] = std::nan("");
    CHECK_THROWS_AS(go(), RecipeError);
    options.emission_by_wedge = std::span<const double>(emission).first(7);
    CHECK_THROWS_AS(go(), GeometryError);
}
