#include "app/process/arriving/trace.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/arriving/rates.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/step_model.hpp"

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE("a model's neutrals are traced in one pass, each with its own sticking and in its own place") {
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/sf6o2_hole.toml",
                                      {"flux.rays=20000", "simplify.method=\"none\""});
    const Model model = make_model(expanded_steps(recipe).front(), recipe.materials, recipe.domain);
    REQUIRE(flux_names(model.species).size() == 6);
    Timing timing;
    double last = 0.0;
    const auto progress = [&](double part) {
        CHECK(part >= last);
        last = part;
    };
    const TracedSurface surface =
        trace_surface(recipe, model, initial_state(recipe).stack, {}, {.progress = progress}, timing);
    REQUIRE(surface.arriving);
    REQUIRE(surface.arriving->trace);
    const std::vector<flux::FluxResult>& fluxes = surface.arriving->trace->species;
    CHECK(last > 0.9);
    REQUIRE(fluxes.size() == 3);
    CHECK(surface.arriving->flux.size() == 6);
    CHECK(fluxes[0].others.size() == 3);
    CHECK(fluxes[0].pass_species == 1);
    for (const std::size_t k : {1u, 2u}) {
        const flux::FluxResult& result = fluxes[k];
        CHECK(result.pass_species == 2);
        CHECK(result.pass_place == k - 1);
        CHECK(result.segments == fluxes[1].segments);
        CHECK(result.ledger.balanced());
        // On bare sites oxygen sticks where it lands and the etchant sticks less. The shared paths are the
        // etchant's, and oxygen's part of them equals a trace of oxygen alone.
        const std::vector<double> sticking(surface.arriving->wedges.count(),
                                           model.species[k].sticking.front());
        const flux::FluxResult own =
            flux::trace_flux(surface.traced(), *surface.scene, surface.box, model.species[k],
                             surface.arriving->materials, surface.arriving->wedges,
                             {.rays = 20000,
                              .seed = static_cast<std::uint64_t>(recipe.flux.seed),
                              .species_index = 1,
                              .batches = static_cast<std::uint32_t>(recipe.flux.batches),
                              .sticking_by_wedge = sticking});
        CHECK(result.wedge.flux == own.wedge.flux);
        CHECK(result.wedge.error == own.wedge.error);
        CHECK(result.arrivals == own.arrivals);
    }
    CHECK(fluxes[1].arrivals > fluxes[2].arrivals);
}

TEST_CASE("rounding of the place on a triangle makes no flux negative") {
    SurfaceFlux arriving;
    arriving.wedges.corner = {0, 1, 2};
    arriving.flux = {{1.0, 0.0, 0.0}};
    const float u = 0.7f, v = std::nextafter(1.0f - u, 1.0f);  // sum to more than 1
    double value = 1.0;
    interpolate(arriving, 0, u, v, {&value, 1});
    CHECK(static_cast<double>(u) + static_cast<double>(v) > 1.0);
    CHECK(value == 0.0);
}
