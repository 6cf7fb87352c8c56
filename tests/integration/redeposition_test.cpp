#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/trace.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/step_model.hpp"
#include "app/results/metrology.hpp"
#include "levelset/meshes/extract.hpp"

// Balance of atoms: what a beam removes is deposited or escapes.
using namespace sidewall;

namespace {

// A trench in silicon under a stop that the beam does not etch. With Y = cos theta the floor stays flat. A
// yield that rises with the angle would roughen it, and the grid smooths away what the fluxes have counted.
app::Recipe trench(const std::vector<std::string>& overrides) {
    return app::parse_recipe(R"([domain]
extent = [1.2, 0.06]
grid_spacing = 0.02
boundary = ["periodic", "periodic"]
[[material]]
name = "Stop"
density = 5.02
[[material]]
name = "Film"
density = 5.02
[[layer]]
material = "Si"
shape = "trench"
width = 0.79
depth = 1.21
[[layer]]
material = "Stop"
shape = "trench"
thickness = 0.105
width = 0.79
[[step]]
model = "ion_beam"
duration = 4.0
rate = { Si = 0.02, Film = 0.02 }
yield = [1.0]
redeposition_fraction = 1.0
deposit = "Film"
ion_exponent = 1e6
[flux]
rays = 30000
[simplify]
method = "none"
)",
                             "trench.toml", overrides);
}

// Numbers of atoms, in 1e22 /cm^3 times volume.
struct Atoms {
    double removed = 0.0;    // net, of the silicon
    double deposited = 0.0;  // net, of everything else
    double sent = 0.0;       // taken away in all, wherever it went
    double escaped = 0.0;    // part of `sent` that left by the open top
};

// Atoms per time: the model's speed under one tally alone, integrated over the traced surface.
double atoms(const app::Recipe& recipe, const app::Model& model, const app::TracedSurface& surface,
             std::size_t tally) {
    const app::SurfaceFlux& arriving = *surface.arriving;
    const TriangleMesh& mesh = surface.traced();
    const flux::TallyFlux& counted = arriving.trace->species[0].tally(tally);
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::vector<double> flux(arriving.flux.size(), 0.0);
        flux[tally] = counted.triangle.flux[t];
        const double speed = model.speed({arriving.materials[t], flux});
        const int of = speed > 0.0 ? *model.deposit : arriving.materials[t];
        sum += triangle_area(mesh, t) * speed * recipe.materials[static_cast<std::size_t>(of)].density;
    }
    return sum;
}

// Time from which atoms are counted. Before, re-distancing rounds the corners that the layers start with.
constexpr double kSettled = 0.5;

Atoms mill(const std::vector<std::string>& overrides) {
    const app::Recipe recipe = trench(overrides);
    const app::Step step = app::expanded_steps(recipe).front();
    const app::Model model = app::make_model(step, recipe.materials, recipe.domain);
    app::RunState state = app::initial_state(recipe);
    levelset::begin_film(state.stack, *model.deposit);
    const auto volumes = [&] {
        const std::vector<double> layers = app::layer_volumes(state.stack);
        std::vector<double> materials(recipe.materials.size());
        for (std::size_t k = 0; k < layers.size(); ++k)
            materials[static_cast<std::size_t>(state.stack.layers[k].material)] += layers[k];
        return materials;
    };
    std::vector<double> before;
    app::Timing timing;
    Atoms total;
    for (double time = 0.0; time < step.duration * (1.0 - 1e-9);) {
        if (before.empty() && time > kSettled) before = volumes();
        const app::TracedSurface surface =
            app::trace_surface(recipe, model, state.stack, state.carried, {.key = state.time_step++}, timing);
        const levelset::Motion motion = app::surface_motion(model, state.stack, surface, timing);
        const double left = step.duration - time, reach = recipe.advection.cfl * recipe.domain.grid_spacing;
        const double dt = left / std::ceil(left * levelset::max_speed(state.stack, motion) / reach);
        const flux::Ledger& ledger = surface.arriving->trace->species[0].redeposited;
        REQUIRE(ledger.balanced());
        const double sent = -atoms(recipe, model, surface, 1), landed = atoms(recipe, model, surface, 2);
        const auto share = [&](std::uint64_t part) {
            return static_cast<double>(part) / static_cast<double>(ledger.emitted);
        };
        // Weights are whole multiples of 2^-28.
        CHECK(landed == Approx(sent * share(ledger.absorbed)).epsilon(1e-5));
        if (!before.empty()) {
            total.sent += dt * sent;
            total.escaped += dt * sent * share(ledger.escaped);
        }
        levelset::advect(state.stack, motion, dt, recipe.advection);
        time += dt;
    }
    const std::vector<double> after = volumes();
    for (std::size_t m = 0; m < after.size(); ++m) {
        const double grown = recipe.materials[m].density * (after[m] - before[m]);
        (m == 0 ? total.removed : total.deposited) += m == 0 ? -grown : grown;
    }
    return total;
}

}  // namespace

TEST_CASE("what an ion beam takes out of a trench sticks or escapes, whatever its energy and tilt",
          "[slow]") {
    const std::vector<std::string> beam = GENERATE(
        std::vector<std::string>{"step[0].energy=100"},
        std::vector<std::string>{"step[0].energy=100", "domain.grid_spacing=0.0125"},
        std::vector<std::string>{"step[0].energy=500"},
        std::vector<std::string>{"step[0].tilt_deg=20", "step[0].reflect_from_deg=89"},
        std::vector<std::string>{"step[0].energy=500", "step[0].tilt_deg=20", "step[0].rotating=true"},
        std::vector<std::string>{"step[0].redeposition_sticking=0.3"});
    const Atoms atoms = mill(beam);
    CAPTURE(beam, atoms.removed, atoms.deposited, atoms.escaped, atoms.sent);
    CHECK(atoms.deposited <= atoms.removed);
    // At edges the front has normals that the traced triangles have not: there are six of them along the
    // trench, and each may be off by a twelfth of a cell's area.
    const app::Recipe recipe = trench(beam);
    const double cell = recipe.domain.extent[1] * std::pow(recipe.domain.grid_spacing, 2),
                 balance = atoms.deposited + atoms.escaped;
    CHECK(balance == Approx(atoms.removed).margin(0.5 * cell * recipe.materials[0].density).epsilon(0));
    // Where the beam leaves a steady shadow, a third as many atoms are removed, beside as many edges.
    const bool shadow = beam[0] == "step[0].tilt_deg=20";
    const double share = beam.size() == 2 && beam[1].starts_with("domain") ? 0.01 : 0.015;
    if (!shadow) CHECK(balance == Approx(atoms.removed).epsilon(share));
}
