#include "app/process/arriving/flux_methods.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/arriving/radiosity_fluxes.hpp"
#include "app/process/arriving/trace.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/radiosity/exchange.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

Recipe quick(const std::string& name, std::vector<std::string> overrides) {
    return load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name + ".toml", overrides);
}

TracedSurface traced(const Recipe& recipe, bool settle) {
    const Model model = make_model(expanded_steps(recipe).front(), recipe.materials, recipe.domain);
    Timing timing;
    RunState state = initial_state(recipe);
    if (model.deposit) levelset::begin_film(state.stack, *model.deposit);
    return trace_surface(recipe, model, state.stack, {}, {.settle = settle}, timing);
}

double mean(const SurfaceFlux& arriving, const std::vector<double>& values) {
    double sum = 0.0, area = 0.0;
    for (std::size_t w = 0; w < values.size(); ++w) {
        sum += arriving.wedges.area[w] * values[w];
        area += arriving.wedges.area[w];
    }
    return sum / area;
}

}  // namespace

TEST_CASE("turns of the coverages trace no ray where radiosity solves, and settle where Monte Carlo's do") {
    const auto settled = [](const std::string& method, bool settle) {
        return traced(quick("sf6o2_hole", {"flux.method=" + method, "flux.rays=100000"}), settle);
    };
    const TracedSurface once = settled("radiosity", false), solved = settled("radiosity", true),
                        counted = settled("monte-carlo", true);
    const TraceReport &one = *once.arriving->trace, &many = *solved.arriving->trace,
                      &paths = *counted.arriving->trace;
    REQUIRE(one.traces == 1);
    REQUIRE(many.traces > 2);
    for (const std::size_t k : {1u, 2u}) {
        CHECK(many.methods[k].radiosity);
        CHECK(many.species[k].emitted == one.species[k].emitted);
        CHECK(many.species[k].segments == one.species[k].segments);
        CHECK(std::abs(static_cast<double>(many.species[k].emitted) - 1e5) < 1e3);
        CHECK(many.species[k].wedge.flux != one.species[k].wedge.flux);  // in `one` the sites were free
    }
    // Ions are traced in both cases, with the same random numbers.
    CHECK_FALSE(many.methods[0].radiosity);
    CHECK(many.methods[0].reason == "its particles have energy");
    CHECK(many.species[0].wedge.flux == paths.species[0].wedge.flux);
    CHECK(many.species[0].others[1].wedge.flux == paths.species[0].others[1].wedge.flux);
    // theta of one reactant is x / (1 + x) with x proportional to its flux and the other's coverage, so that
    // d theta / d ln flux <= 1/4 for each; relative_error bounds the error of a mean flux.
    double error = 2.0 * 1e-3;  // the tolerance to which both have settled
    for (const TraceReport* report : {&many, &paths})
        for (const std::size_t k : {1u, 2u}) error += 0.25 * report->species[k].relative_error;
    for (const std::size_t site : {0u, 1u}) {
        const double theta = mean(*solved.arriving, solved.arriving->coverage[site]);
        CHECK(theta > 0.01);
        CHECK(std::abs(theta - mean(*counted.arriving, counted.arriving->coverage[site])) < error);
    }
}

TEST_CASE("radiosity asked for is taken by what is re-emitted diffusely, relative_error bounds its flux") {
    const TracedSurface surface =
        traced(quick("ald_hole", {"flux.method=radiosity", "flux.relative_error=0.01"}), true);
    const TraceReport& trace = *surface.arriving->trace;
    CHECK(trace.traces == 10);
    CHECK(trace.methods[0].radiosity);
    CHECK(trace.species[0].relative_error <= 0.01);
    // Models receive the solved flux itself.
    CHECK(surface.arriving->flux[0] == trace.species[0].wedge.flux);
    CHECK(trace.error[0] == trace.species[0].wedge.error);
    // In so little memory fewer rays fit: no more are gathered, and the reported error is larger.
    const TracedSurface small = traced(
        quick("ald_hole", {"flux.method=radiosity", "flux.relative_error=0.0001", "flux.memory=0.001"}),
        true);
    const flux::FluxResult& little = small.arriving->trace->species[0];
    CHECK(static_cast<double>(flux::exchange_bytes(little.emitted)) < 1.01e6);
    CHECK(little.relative_error > 0.0001);
}

TEST_CASE("auto takes the gases of a round contact by radiosity, which leaves its open walls without noise") {
    const TracedSurface contact = traced(quick("contact_round", {"flux.relative_error=0.05"}), false);
    const std::vector<SpeciesMethod>& methods = contact.arriving->trace->methods;
    REQUIRE(methods.size() == 3);
    CHECK_FALSE(methods[0].radiosity);  // ions
    CHECK(methods[1].radiosity);
    CHECK(methods[2].radiosity);
    CHECK(methods[1].reason.ends_with("times as much as its paths at a relative error of 0.025"));
}

TEST_CASE("auto decides for a step's species at the first turn, alike every time, and says why") {
    const auto chosen = [](const std::string& name, const std::string& asked) {
        return traced(quick(name, {"flux.method=auto", asked}), false).arriving->trace->methods;
    };
    const auto deep = chosen("ald_hole", "flux.relative_error=0.02");
    REQUIRE(deep.size() == 1);
    CHECK(deep[0].radiosity);
    CHECK(deep[0].reason.find("radiosity costs about 0.") == 0);
    CHECK(describe(deep).starts_with("precursor by radiosity (radiosity costs"));
    CHECK(chosen("ald_hole", "flux.relative_error=0.02")[0].reason == deep[0].reason);
    const auto mixed = chosen("sf6o2_hole", "flux.rays=20000");
    REQUIRE(mixed.size() == 3);
    CHECK_FALSE(mixed[0].radiosity);
    CHECK(describe(mixed).starts_with("ion by monte-carlo (its particles have energy); etchant by "));
    // Ions are traced bottom-up (adjoint) with auto alone, where their rays suffice, and only where averaging
    // leaves them no direct flux of their own, which would need no paths.
    const auto uses_adjoint = [](const std::string& method, int rays, const std::string& averaging = "0.06") {
        const TracedSurface surface =
            traced(quick("sf6o2_hole", {"flux.method=" + method, "flux.rays=" + std::to_string(rays),
                                        "flux.averaging=" + averaging}),
                   false);
        CHECK(surface.traced().triangles.size() < 5000);
        CHECK(surface.traced().triangles.size() > 250);
        return surface.arriving->trace->species[0].adjoint;
    };
    CHECK(uses_adjoint("auto", 60'000));
    CHECK_FALSE(uses_adjoint("auto", 60'000, "0"));
    CHECK_FALSE(uses_adjoint("auto", 3000));
    CHECK_FALSE(uses_adjoint("monte-carlo", 60'000));
    // A method chosen earlier in the step is kept.
    const Recipe recipe = quick("ald_hole", {"flux.method=auto", "flux.rays=1000"});
    const Model model = make_model(expanded_steps(recipe).front(), recipe.materials, recipe.domain);
    Timing timing;
    RunState state = initial_state(recipe);
    levelset::begin_film(state.stack, *model.deposit);
    for (const bool radiosity : {false, true}) {
        const TracedSurface surface = trace_surface(
            recipe, model, state.stack, {}, {.methods = {{"precursor", radiosity, "as before"}}}, timing);
        CHECK(surface.arriving->trace->methods[0].radiosity == radiosity);
        CHECK(surface.arriving->trace->methods[0].reason == "as before");
    }
}

TEST_CASE("auto gathers rays to the error that it compared the methods at, not their number") {
    const Recipe recipe = quick("ald_hole", {"flux.method=auto", "flux.rays=20000"});
    const TraceReport trace = *traced(recipe, false).arriving->trace;
    REQUIRE(trace.methods[0].radiosity);
    CHECK(trace.methods[0].target > 0.0);
    CHECK(trace.species[0].relative_error <= trace.methods[0].target);
    const TraceReport paths =
        *traced(quick("ald_hole", {"flux.method=monte-carlo", "flux.rays=20000"}), false).arriving->trace;
    CHECK(trace.methods[0].target == Approx(paths.species[0].relative_error).epsilon(0.3));
    CHECK(trace.species[0].segments < paths.species[0].segments / 2);
}

TEST_CASE("a profile is coarsened for radiosity as for paths, to the same line on both sides") {
    const auto mesh_of = [](const std::string& method) {
        return traced(quick("bosch_trench", {"flux.method=" + method}), false).traced();
    };
    const TriangleMesh paths = mesh_of("monte-carlo"), solved = mesh_of("radiosity");
    CHECK(static_cast<double>(solved.vertices.size()) ==
          Approx(static_cast<double>(paths.vertices.size())).epsilon(0.2));
    CHECK(solved.triangles.size() == solved.vertices.size() - 2);
    for (std::size_t v = 0; v < solved.vertices.size(); v += 2) {
        const Vec3 &p = solved.vertices[v], &q = solved.vertices[v + 1];
        CHECK(p.x() == q.x());
        CHECK(p.z() == q.z());
        CHECK(p.y() < q.y());
    }
    CHECK(total_area(solved) == Approx(total_area(paths)).epsilon(1e-3));
}

TEST_CASE("the memory that radiosity may take is that of its rays, bounded by flux.memory") {
    const auto bytes = [](std::vector<std::string> settings) {
        return radiosity_memory(quick("ald_hole", std::move(settings)).flux);
    };
    CHECK(bytes({"flux.method=monte-carlo"}) == 0.0);
    CHECK(bytes({"flux.method=radiosity", "flux.rays=1000"}) ==
          static_cast<double>(flux::exchange_bytes(1000)));
    CHECK(bytes({"flux.method=auto", "flux.rays=1e12", "flux.memory=0.5"}) == 0.5e9);
    CHECK(bytes({"flux.method=radiosity", "flux.relative_error=0.1", "flux.memory=0.5"}) == 0.5e9);
    const Recipe huge = quick("ald_hole", {"flux.method=radiosity", "flux.rays=1e12", "flux.memory=1e6"});
    CHECK_THROWS_WITH(
        require_memory(huge, domain_of(huge)),
        Catch::Contains("flux.memory = 1e+06: besides") && Catch::Contains("lower it, or flux.rays"));
}
