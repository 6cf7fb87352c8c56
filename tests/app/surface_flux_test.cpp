#include "app/surface_flux.hpp"

#include <catch2/catch.hpp>

#include "app/run_state.hpp"

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE("a model's neutrals are traced in one pass, each with its own sticking and in its own place") {
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/sf6o2_hole.toml",
                                      {"flux.rays=20000", "simplify.method=\"none\""});
    const Model model = make_model(expanded_steps(recipe).front(), recipe.materials, recipe.domain);
    REQUIRE(flux_names(model.species).size() == 6);
    Timing timing;
    double last = 0.0;
    const SurfaceFlux surface =
        trace_surface(recipe, model, initial_state(recipe).stack, {}, false, 0, timing, [&](double part) {
            CHECK(part >= last);
            last = part;
        });
    CHECK(last > 0.9);
    REQUIRE(surface.fluxes.size() == 3);
    CHECK(surface.wedge_flux.size() == 6);
    CHECK(surface.fluxes[0].others.size() == 3);
    CHECK(surface.fluxes[0].pass_species == 1);
    for (const std::size_t k : {1u, 2u}) {
        const flux::FluxResult& result = surface.fluxes[k];
        CHECK(result.pass_species == 2);
        CHECK(result.pass_place == k - 1);
        CHECK(result.segments == surface.fluxes[1].segments);
        CHECK(result.ledger.balanced());
        // On bare sites the etchant sticks less than oxygen does, which sticks where it lands: the paths are
        // the etchant's, and oxygen's part of them is what it would fly alone.
        const std::vector<double> sticking(surface.wedges.count(), model.species[k].sticking.front());
        const flux::FluxResult own =
            flux::trace_flux(surface.traced(), *surface.scene, surface.box, model.species[k],
                             surface.materials, surface.wedges,
                             {.rays = 20000,
                              .seed = static_cast<std::uint64_t>(recipe.flux.seed),
                              .species_index = 1,
                              .batches = static_cast<std::uint32_t>(recipe.flux.batches),
                              .sticking_by_wedge = sticking});
        CHECK(result.wedge.flux == own.wedge.flux);
        CHECK(result.wedge.error == own.wedge.error);
        CHECK(result.arrivals == own.arrivals);
    }
    CHECK(surface.fluxes[1].arrivals > surface.fluxes[2].arrivals);
}
