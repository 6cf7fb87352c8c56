#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/trace.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/step_model.hpp"
#include "levelset/meshes/extract.hpp"

// Conservation: the film that the level set grows against what the fluxes bring.
using namespace sidewall;

namespace {

double volume_above_zero(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
    return sum;
}

// Integral over `mesh` of the speed that the fluxes on `surface` give its nearest points; volume per time.
double growth(const app::Model& model, const app::TracedSurface& surface, const TriangleMesh& mesh) {
    const app::SurfaceFlux& arriving = *surface.arriving;
    std::vector<double> values(arriving.flux.size());
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const surface::SurfaceHit hit = surface.scene->closest_point(triangle_centroid(mesh, t), 1e30);
        app::interpolate(arriving, hit.triangle, hit.u, hit.v, values);
        sum += triangle_area(mesh, t) * model.speed({arriving.materials[hit.triangle], values});
    }
    return sum;
}

// Film volume of a recipe's first step over the integral of flux x rate x area, less 1. The flux is the one
// each time step moves by; the area is the mean of those before and after.
double film_error(const std::string& name, const std::vector<std::string>& overrides) {
    const app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name, overrides);
    const app::Step step = app::expanded_steps(recipe).front();
    const app::Model model = app::make_model(step, recipe.materials, recipe.domain);
    app::RunState state = app::initial_state(recipe);
    levelset::begin_film(state.stack, *model.deposit);
    levelset::MaterialStack& stack = state.stack;
    const double before = volume_above_zero(levelset::extract_surface(stack.top(), stack.domain));
    app::Timing timing;
    double deposited = 0.0, time = 0.0;
    while (time < step.duration * (1.0 - 1e-9)) {
        const app::TracedSurface surface =
            app::trace_surface(recipe, model, stack, state.carried, {.key = state.time_step++}, timing);
        const levelset::Motion motion = app::surface_motion(model, stack, surface, timing);
        const double left = step.duration - time, reach = recipe.advection.cfl * stack.domain.spacing;
        const double dt = left / std::ceil(left * levelset::max_speed(stack, motion) / reach);
        levelset::advect(stack, motion, dt, recipe.advection);
        const TriangleMesh after = levelset::extract_surface(stack.top(), stack.domain);
        deposited += 0.5 * dt * (growth(model, surface, surface.raw) + growth(model, surface, after));
        time += dt;
    }
    const double after = volume_above_zero(levelset::extract_surface(stack.top(), stack.domain));
    return (after - before) / deposited - 1.0;
}

}  // namespace

TEST_CASE("the film's volume is the integral of flux times rate times area, and converges to it", "[slow]") {
    struct Row {
        const char* name;
        std::vector<std::string> overrides;
        std::vector<std::string> spacings;
    };
    // Marching cubes cuts off concave corners: the area, and with it the integral, falls short by a share of
    // dx.
    // Long time steps add an error to the hole's that does not fall with dx: at cfl 0.5 the finest grid's
    // error is 0.47 to 0.54 of the coarsest's, by seeds; at 0.1 it is 0.40 +- 0.01.
    for (const Row& row : {Row{"trench_deposition.toml",
                               {"domain.extent=[10.0, 0.5]", "step[0].duration=1.0", "flux.rays=40000"},
                               {"0.25", "0.125", "0.0625"}},
                           Row{"hole_deposition.toml",
                               {"flux.rays=100000", "advection.cfl=0.1"},
                               {"0.2", "0.1", "0.0666666666666667"}},
                           Row{"fin_deposition.toml",
                               {"domain.extent=[6.0, 0.25]", "step[0].duration=1.0", "flux.rays=40000"},
                               {"0.125", "0.0625", "0.03125"}}}) {
        std::vector<double> errors;
        for (const std::string& spacing : row.spacings) {
            std::vector<std::string> overrides = row.overrides;
            overrides.push_back("domain.grid_spacing=" + spacing);
            errors.push_back(std::abs(film_error(row.name, overrides)));
        }
        CAPTURE(row.name, errors);
        for (const double error : errors) CHECK(error < 0.01);
        CHECK(errors.back() < 0.5 * errors.front());
    }
}
