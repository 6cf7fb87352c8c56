#include <catch2/catch.hpp>
#include <cmath>

#include "app/models/chemistry.hpp"
#include "app/models/expression.hpp"
#include "app/models/formula_laws.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/yield.hpp"

// Expressions in recipes: their values, and which are refused.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

const std::string kFormulaWafer = R"([domain]
extent = [4.0, 4.0]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[[step]]
model = "formula"
duration = 2.0
)";

struct Formulated {
    Recipe recipe;
    Model model;
    SurfacePoint point(const char* material, std::span<const double> flux,
                       std::span<const double> theta = {}) const {
        return {*material_id(recipe.materials, material), flux, Vec3::UnitZ(), true, theta};
    }
};

Formulated formulated(const std::string& keys) {
    Formulated result{parse_recipe(kFormulaWafer + keys, "step.toml"), {}};
    result.model = make_model(result.recipe.steps.at(0), result.recipe.materials, result.recipe.domain);
    return result;
}

std::string formula_refusal(const std::string& keys) {
    try {
        formulated(keys);
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

// A step whose rate of silicon is this expression.
std::string rate(const std::string& text) {
    return "species = [{ name = \"F\" }, { name = \"ion\", kind = \"ion\" }]\nparameters = { k = 0.3 }\n"
           "coverages = { theta = \"k*F/(k*F + 1)\" }\nrate = { Si = '" +
           text + "' }\n";
}

const std::string kIon = "rate = 0\nspecies = [{ name = \"ion\", kind = \"ion\", yields = [{ name = \"y\", ";

}  // namespace

TEST_CASE("a formula's rate is what its expression says, by material, place and time") {
    const Formulated etch = formulated(R"TOML(species = [{ name = "F" }, { name = "ion", kind = "ion" }]
parameters = { k = 0.3, twice = "2*pi" }
coverages = { theta = "k*F/(k*F + 1)" }
rate = { Si = "-0.1*F*(1 - theta) - 0.02*ion*cos", SiO2 = "-twice*depth - x*y + (time > 1 ? 3 : 4)*z", Ge = "-density" }
)TOML");
    CHECK(flux_names(etch.model.species) == std::vector<std::string>{"F", "ion", "ion_cos"});
    const std::vector<double> flux{0.5, 0.8, 0.6}, theta{0.2};
    CHECK(etch.model.speed(etch.point("Si", flux, theta)) ==
          Approx(-0.1 * 0.5 * 0.8 - 0.02 * 0.8 * 0.75).epsilon(1e-14));
    CHECK(etch.model.speed(etch.point("Ge", flux, theta)) == -4.42);
    CHECK(etch.model.speed(etch.point("Mask", flux, theta)) == 0.0);  // a material that the table leaves out
    SurfacePoint point = etch.point("SiO2", flux, theta);
    point.position = Vec3(2.0, 3.0, -0.5);
    CHECK(etch.model.depends_on_position);
    CHECK(etch.model.speed(point) == Approx(-std::numbers::pi - 6.0 - 2.0).epsilon(1e-14));
    point.time = 1.5;
    CHECK(etch.model.speed(point) == Approx(-std::numbers::pi - 6.0 - 1.5).epsilon(1e-14));
    CHECK(etch.model.min_time_steps == 100);  // a rate that depends on time is resolved

    std::vector<double> settled{0.0};
    etch.model.coverages.react(etch.point("Si", flux, settled), 0.0, settled);
    CHECK(settled[0] == Approx(0.15 / 1.15).epsilon(1e-14));
    CHECK_FALSE(etch.model.sticking);  // a constant sticking stays with the species
    CHECK_FALSE(etch.model.deposit);

    const Formulated plain = formulated("rate = { default = -0.5, Mask = 0 }\n");
    CHECK(plain.model.species.empty());
    CHECK(plain.model.min_time_steps == 1);
    CHECK_FALSE(plain.model.depends_on_position);
    CHECK(plain.model.speed(plain.point("Si", {})) == -0.5);
    CHECK(plain.model.speed(plain.point("Mask", {})) == 0.0);
}

TEST_CASE("sf6_o2 written as a formula has the built-in model's speed and sticking on a flat wafer") {
    const Formulated etch = formulated(R"TOML(species = [
    { name = "ion", kind = "ion", yields = [
        { name = "sputter", angular = "(1 + 9.3*(1 - cos^2))*cos", energy = "sqrt(E) - sqrt(20)", scale = 0.0337 },
        { name = "enhanced", angular = "cos >= 0.5 ? 1 : 3 - 6*acos(cos)/pi", energy = "sqrt(E) - sqrt(15)", scale = 7 } ] },
    { name = "etchant", sticking = { Si = "0.7*(1 - e - p)", default = 0.1 } }, { name = "oxygen", sticking = "1 - e - p" } ]
coverages = { e = "4500*etchant*(1 - p)/(4500*etchant + 300 + 20*ion_enhanced)", p = "800*oxygen*(1 - e)/(800*oxygen + 0.04 + 30*ion_enhanced)" }
rate = { Si = "-1e-3*(10*ion_sputter + e*(300/4 + 10*ion_enhanced))/density" }
)TOML");
    // Ions at normal incidence and 100 eV, by hand.
    const double sputter = 0.0337 * (10.0 - std::sqrt(20.0)), enhanced = 7.0 * (10.0 - std::sqrt(15.0));
    const std::vector<double> flux{1.0, sputter, enhanced, 1.0, 1.0};
    std::vector<double> theta(2, 0.0);
    etch.model.coverages.react(etch.point("Si", flux, theta), 0.0, theta);
    // The two coverages depend on each other. Expected is the closed form of competing adsorbates.
    const auto exact =
        competing_coverages<2>({{{4500.0, 300.0 + 20.0 * enhanced}, {800.0, 0.04 + 30.0 * enhanced}}});
    CHECK(theta[0] == Approx(exact[0]).epsilon(1e-9));
    CHECK(theta[1] == Approx(exact[1]).epsilon(1e-9));
    const SurfacePoint point = etch.point("Si", flux, theta);
    CHECK(etch.model.speed(point) ==
          Approx(-1e-3 * (10.0 * sputter + exact[0] * (75.0 + 10.0 * enhanced)) / 5.02).epsilon(1e-9));
    CHECK(etch.model.sticking(0, point) == 0.0);  // ions have a law of reflection instead
    CHECK(etch.model.sticking(1, point) == Approx(0.7 * (1.0 - theta[0] - theta[1])).epsilon(1e-12));
    CHECK(etch.model.sticking(1, etch.point("Mask", flux, theta)) == 0.1);
}

TEST_CASE("tabulated yields are the laws they were written as") {
    const Formulated etch = formulated(R"TOML(rate = 0
species = [{ name = "ion", kind = "ion", energy = 200.0, yields = [
    { name = "sputter", angular = "(1 + 9.3*(1 - cos^2))*cos", energy = "sqrt(E) - sqrt(20)", scale = { Si = 0.5, default = 0.25 } },
    { name = "enhanced", angular = "cos >= 0.5 ? 1 : 3 - 6*acos(cos)/pi", energy = "E < 50 ? 0 : E/10" },
    { name = "even", energy = "3", scale = 2 }, { name = "smooth", angular = "exp(-2*(1/max(cos, 1e-3) - 1))/sqrt(max(cos, 1e-3))", energy = "E" } ] }]
)TOML");
    const flux::Species& ion = etch.model.species.at(0);
    const auto yield = [&](std::size_t k, double energy, double cosine, std::size_t material = 0) {
        return flux::yield_of(ion.yields.at(k), material, true, energy, cosine);
    };
    for (const double cosine : {1.0, 0.9, 0.5, 0.3, 0.01})
        for (const double energy : {5.0, 19.0, 21.0, 49.0, 51.0, 200.0, 300.0}) {
            CAPTURE(cosine, energy);
            const double root = std::max(0.0, std::sqrt(energy) - std::sqrt(20.0));
            const double f = (1.0 + 9.3 * (1.0 - cosine * cosine)) * cosine;
            CHECK(yield(0, energy, cosine) == Approx(0.5 * root * f).epsilon(1e-11).margin(1e-13));
            CHECK(yield(0, energy, cosine, 1) == Approx(0.25 * root * f).epsilon(1e-11).margin(1e-13));
            // Beyond a kink, which is one of the table's angles, the law is linear in the angle.
            const double g = cosine >= 0.5 ? 1.0 : 3.0 - 6.0 * std::acos(cosine) / std::numbers::pi;
            // E is quadratic in sqrt(E): linear between nodes of spacing h it is too large by h^2/4 at most.
            const double h = (std::sqrt(360.0) - std::sqrt(50.0)) / 1024.0;
            CHECK(yield(1, energy, cosine) ==
                  Approx(energy < 50.0 ? 0.0 : g * energy / 10.0).margin(h * h / 40.0 + 1e-12));
            CHECK(yield(2, energy, cosine) == Approx(6.0).epsilon(1e-14));
            if (cosine < 0.3) continue;  // below, a smooth law: off by h^2/8 times y'', under 400 y
            const double y = std::exp(-2.0 * (1.0 / cosine - 1.0)) / std::sqrt(cosine);
            const double step = std::numbers::pi / 2.0 / 3072.0, from_zero = std::sqrt(360.0) / 1024.0;
            const double off = energy * 400.0 * step * step / 8.0 + from_zero * from_zero / 4.0;
            CHECK(yield(3, energy, cosine) == Approx(y * energy).margin(off * y + 1e-12));
        }
    CHECK(ion.yields[0].threshold == Approx(20.0).epsilon(1e-12));
    CHECK(ion.yields[1].threshold == Approx(50.0).epsilon(1e-12));
    CHECK(ion.stop_energy == 0.0);  // the third yield has no threshold
}

TEST_CASE("coverages that name each other settle, and those with a rate follow time exactly") {
    // Two adsorbates at high coverage, where fixed-point iteration would take thousands of iterations.
    std::vector<double> theta{0.0, 0.0};
    CHECK(solve_coverages(
        [](std::span<const double> at, std::span<double> result) {
            result[0] = 999.0 * (1.0 - at[1]) / 1000.0;
            result[1] = 499.0 * (1.0 - at[0]) / 500.0;
        },
        theta));
    const auto exact = competing_coverages<2>({{{999.0, 1.0}, {499.0, 1.0}}});
    CHECK(theta[0] == Approx(exact[0]).epsilon(1e-8));
    CHECK(theta[1] == Approx(exact[1]).epsilon(1e-8));
    std::vector<double> none{0.5};
    CHECK_FALSE(solve_coverages(
        [](std::span<const double> at, std::span<double> result) { result[0] = at[0] + 1.0; }, none));

    // d theta/dt = 2 (1 - theta) - 3 theta, over short and long times; and theta^2, which is not linear.
    for (const double time : {1e-3, 0.1, 1e4}) {
        std::vector<double> one{0.9};
        CHECK(integrate_coverages(
            [](std::span<const double> at, std::span<double> result) {
                result[0] = 2.0 * (1.0 - at[0]) - 3.0 * at[0];
            },
            time, one));
        CHECK(one[0] == Approx(pulsed_coverage(0.9, 2.0, 3.0, 1.0, time)).epsilon(1e-8));
        std::vector<double> pair{1.0, 0.0};  // the second gains what the first loses
        CHECK(integrate_coverages(
            [](std::span<const double> at, std::span<double> result) {
                result[0] = -at[0] * at[0];
                result[1] = at[0] * at[0];
            },
            time, pair));
        CHECK(pair[0] == Approx(1.0 / (1.0 + time)).epsilon(1e-3).margin(1e-5));
        CHECK(pair[0] + pair[1] == Approx(1.0).epsilon(1e-7));
    }
    std::vector<double> explodes{1.0};
    CHECK_FALSE(integrate_coverages(
        [](std::span<const double> at, std::span<double> result) { result[0] = at[0] * at[0]; }, 2.0,
        explodes));
}

TEST_CASE("a blank before a function's bracket changes nothing") {
    const Expression close("2*exp(-x) + max(x, y)*(x)", {"x", "y"}, {});
    const std::vector<double> at{0.3, 0.7};
    for (const char* text : {"2*exp (-x) + max(x, y)*(x)", "2*exp  (-x) + max\t(x, y)*(x)",
                             "2 * exp ( -x ) + max ( x, y ) * (x)"})
        CHECK(Expression(text, {"x", "y"}, {})(at) == close(at));
    // Positions count characters of the text as written.
    CHECK_THROWS_WITH(Expression("exp (1) + zz", {"x"}, {}),
                      Contains("character 11, \"zz\": unknown name zz"));
    // A variable in front of a bracket is no function.
    CHECK_THROWS_WITH(Expression("x (1)", {"x"}, {}), Contains("character 3, \"(1)\""));
    CHECK(names_variable("exp + 1", "exp"));
    CHECK_FALSE(names_variable("exp (1)", "exp"));
}

TEST_CASE("a parameter may name others, in any order but a circle") {
    const auto with = [](const std::string& parameters) {
        return "rate = { Si = \"-d\" }\nparameters = { " + parameters + " }\n";
    };
    const auto value = [&](const std::string& parameters) {
        const Formulated made = formulated(with(parameters));
        return -made.model.speed(made.point("Si", {}));
    };
    CHECK(value("k = 0.3, a = \"2*k\", d = \"a + k\"") == Approx(0.9));
    CHECK(value("d = \"a + w\", a = \"2*w\", w = 0.3") == Approx(0.9));
    CHECK(value("d = \"exp (w)\", w = \"pi - pi\"") == Approx(1.0));
    CHECK_THAT(formula_refusal(with("d = \"a\", a = \"2*d\"")), Contains("a, d name each other in a circle"));
    CHECK_THAT(formula_refusal(with("d = \"1 - d\"")), Contains("parameters.d") && Contains("circle"));
    CHECK_THAT(formula_refusal(with("d = \"2*kk\", k = 1")),
               Contains("parameters.d") && Contains("unknown name kk"));
}

TEST_CASE("what cannot be evaluated is refused where it stands, with the nearest name", "[foreign]") {
    const auto refuses = [](const std::string& keys, std::initializer_list<const char*> parts) {
        const std::string message = formula_refusal(keys);
        CAPTURE(keys, message);
        for (const char* part : parts) CHECK_THAT(message, Contains(part));
    };
    refuses(rate("-0.1*Fl"), {"step.toml:13: step[0].rate.Si",
                              "character 6, \"Fl\": unknown name Fl; did you mean F?", "theta"});
    refuses(rate("-sqr(F)"), {"character 2, \"sqr(F)\": unknown function sqr; did you mean sqrt?"});
    refuses(rate("-sqrt(F, 2)"), {"character", "too many parameters for function \"sqrt\""});
    refuses(rate("-atan2(F)"), {"too few parameters for function \"atan2\""});
    refuses(rate("-(F"), {"missing parenthesis"});
    refuses(rate("-F)"), {"unexpected parenthesis"});
    refuses(rate("-F +"), {"unexpected end of expression"});
    refuses(rate("2 F"), {"character 3, \"F\"", "unexpected variable"});
    refuses(rate("F = 2"), {"character 3, \"= 2\"", "compare with =="});
    refuses(rate("F, 2"), {"comma"});
    refuses(rate("   "), {"empty"});
    refuses(rate("\"F\""), {"step[0].rate.Si"});
    refuses(rate("F # 2"), {"character 3"});
    refuses(rate(std::string(30'000, '(')), {"too long"});
    refuses(rate("-E"), {"unknown name E"});
    refuses("rate = \"-1\"\nspecies = [{ name = \"F\", sticking = \"0.1*F\" }]\n",
            {"species[0].sticking", "unknown name F"});  // fluxes follow from the sticking, not the reverse
    refuses("rate = -1\nspecies = [{ name = \"F\", sticking = { Si = 1.2 } }]\n",
            {"species[0].sticking.Si", "must be in [0, 1]"});
    refuses("rate = -1\nspecies = [{ name = \"F\", sticking = \"-0.5 + 0\" }]\n",
            {"species[0].sticking", "must be in [0, 1]"});
    refuses("rate = { Sio2 = \"-1\" }\n", {"rate.Sio2", "unknown material", "SiO2"});
    refuses("rate = true\n", {"step[0].rate", "expression in quotes"});
    refuses("rate = { Si = [1] }\n", {"step[0].rate.Si", "expression in quotes"});
    refuses("rate = {}\n", {"must not be empty"});
    refuses("duration = 1\n", {"duration"});
    refuses("", {"rate: missing"});
    refuses("rate = -1\nparameters = 3\n", {"parameters", "table of expressions"});
    refuses("rate = -1\nparameters = { k = \"2*F\" }\n", {"parameters.k", "unknown name F"});
    refuses("rate = -1\nparameters = { k = \"1/0\" }\n", {"parameters.k", "finite"});
    for (const char* name : {"cos", "x", "time", "pi", "max", "E", "density"})
        refuses(std::string("rate = -1\nparameters = { ") + name + " = 1 }\n",
                {"parameters", "fixed meaning"});
    refuses("rate = -1\nparameters = { \"2k\" = 1 }\n", {"letters, digits and _"});
    refuses("rate = -1\nspecies = [{ name = \"F-2\" }]\n", {"species[0].name", "letters, digits and _"});
    refuses("rate = -1\nspecies = [{ name = \"F\" }]\nparameters = { F = 1 }\n", {"name of another"});
    refuses("rate = -1\nspecies = [{ name = \"F\" }]\ncoverages = { F = 1 }\n",
            {"coverages.F", "name of another"});
    refuses("rate = -1\ncoverages = { a = 1 }\n", {"coverages", "species"});
    refuses("rate = -1\nspecies = [{ name = \"F\" }]\ncoverages = { a = \"b\" }\n",
            {"coverages.a", "unknown name b"});
    refuses("rate = -1\nspecies = [{ name = \"F\", energy = 5.0 }]\n", {"species[0].energy", "is for ions"});
    refuses("rate = -1\nspecies = [{ name = \"F\", cone = 5.0 }]\n", {"species[0].cone", "is for ions"});
    refuses("rate = -1\nspecies = [{ name = \"F\", yields = [{ name = \"y\" }] }]\n",
            {"species[0].yields", "is for ions"});
    refuses("rate = -1\nspecies = [{ name = \"i\", kind = \"ion\", sticking = 0.5 }]\n",
            {"species[0].sticking", "neutrals"});
    refuses("rate = -1\nspecies = [{ name = \"i\", kind = \"ion\", desorption = 0.5 }]\n",
            {"species[0].desorption", "neutrals"});
    refuses("rate = -1\nspecies = [{ name = \"F\", desorption = \"0.1*F\" }]\n",
            {"species[0].desorption", "unknown name F"});
    refuses("rate = -1\nspecies = [{ name = \"F\", desorption = { Si = -0.1 } }]\n",
            {"species[0].desorption.Si", "must be in [0, "});
    refuses("rate = -1\nspecies = [{ name = \"F\", desorption = { Sio2 = 0.1 } }]\n",
            {"desorption.Sio2", "unknown material", "SiO2"});
    const std::string slow =
        "rate = -1\nspecies = [{ name = \"F\" }]\ncoverage_rates = { theta = \"F - theta\" }\n";
    refuses(slow + "diffusion = { theta = -0.1 }\n", {"diffusion.theta", "is -0.1: must be in [0, "});
    refuses(slow + "diffusion = { theta = \"1/0\" }\n", {"diffusion.theta", "must be in [0, "});
    refuses(slow + "diffusion = { theta = \"F\" }\n", {"diffusion.theta", "unknown name F"});
    refuses(slow + "diffusion = { thet = 0.1 }\n", {"diffusion.thet", "coverage_rates"});
    refuses(
        "rate = -1\nspecies = [{ name = \"F\" }]\ncoverages = { theta = \"F\" }\ndiffusion = { theta = 0.1 }\n",
        {"diffusion.theta", "theta is steady", "give coverage_rates its d/dt"});
    refuses(slow + "diffuses_on = [\"Si\"]\n", {"diffuses_on", "give diffusion"});
    refuses(slow + "diffusion = { theta = 0.1 }\ndiffuses_on = [\"Sj\"]\n",
            {"diffuses_on", "unknown material"});
    refuses(slow + "time_spacing = \"cubic\"\n", {"time_spacing", "parabolic"});
    refuses("rate = -1\ntime_spacing = \"parabolic\"\n", {"time_spacing", "time_steps"});
    refuses(kIon + "angular = \"E\" }] }]\n", {"species[0].yields[0].angular", "unknown name E", "cos"});
    refuses(kIon + "energy = \"cos\" }] }]\n", {"species[0].yields[0].energy", "unknown name cos"});
    refuses(kIon + "angular = \"1/cos\" }] }]\n", {"angular", "no finite value where cos is 0"});
    refuses(kIon + "angular = \"-cos\" }] }]\n", {"angular", "nowhere above 0"});
    refuses(kIon + "energy = \"E - 1000\" }] }]\n", {"energy", "not above 0 up to 180 eV"});
    refuses(kIon + "energy = \"ln(E - 30)\" }] }]\n",
            {"accepted"});  // NaN below the first valid energy counts as no yield
    refuses(kIon + "scale = -1 }] }]\n", {"scale", "at least 0"});
    refuses(kIon + "scale = 1, form = 2 }] }]\n", {"yields[0].form", "unknown key"});
}

TEST_CASE(
    "a value that is not finite, and growth without a film, name the law, the material and the values") {
    const Formulated bad =
        formulated("species = [{ name = \"F\" }]\nrate = { Si = \"-ln(F - 0.5)\", SiO2 = \"F - 0.4\" }\n");
    const std::vector<double> some{0.25};
    CHECK_THROWS_WITH(bad.model.speed(bad.point("Si", some)),
                      Contains("rate.Si = \"-ln(F - 0.5)\" is not a number on Si") && Contains("F = 0.25"));
    const std::vector<double> more{0.5};
    CHECK_THROWS_WITH(bad.model.speed(bad.point("Si", more)), Contains("is infinite on Si"));
    CHECK_THROWS_WITH(bad.model.speed(bad.point("SiO2", more)),
                      Contains("positive on SiO2") && Contains("deposit"));
    const Formulated wild =
        formulated("species = [{ name = \"F\" }]\nrate = -1\ncoverages = { a = \"b + F\", b = \"a + 1\" }\n");
    std::vector<double> theta{0.0, 0.0};
    CHECK_THROWS_AS(wild.model.coverages.react(wild.point("Si", some, theta), 0.0, theta), NumericsError);
    CHECK_THROWS_WITH(wild.model.coverages.react(wild.point("Si", some, theta), 0.0, theta),
                      Contains("coverages.a") && Contains("does not converge"));
}

TEST_CASE(
    "a rate that ends where a site is full is refused with its key and what to write, at each place it can be met") {
    const std::vector<double> flux{1.0};
    const auto law = [](const std::string& text) {
        return formulated(
            "species = [{ name = \"F\" }]\nrate = { Si = \"-(1 - theta)^0.5\" }\ncoverage_rates = { theta = '" +
            text + "' }\n");
    };
    // The coverage is full at t = 2; beyond 1 the square root is not a number.
    const Formulated ends = law("F*(1 - theta)^0.5");
    std::vector<double> theta{0.0};
    ends.model.coverages.react(ends.point("Si", flux, theta), 1.0, theta);
    CHECK(theta[0] == Approx(0.75).epsilon(1e-6));
    CHECK_THROWS_WITH(ends.model.coverages.react(ends.point("Si", flux, theta), 2.0, theta),
                      Contains("coverage_rates.theta = \"F*(1 - theta)^0.5\"") && Contains(" on Si") &&
                          Contains("F = 1") && Contains("max(0, 1 - theta)"));
    // A coverage above 1 by rounding, as an etch rate may receive it.
    const std::vector<double> beyond{1.0 + 1e-12};
    CHECK_THROWS_WITH(ends.model.speed(ends.point("Si", flux, beyond)),
                      Contains("rate.Si = \"-(1 - theta)^0.5\" is not a number on Si, where theta = 1") &&
                          Contains("coverages may pass 0 or 1 by rounding"));
    theta = beyond;
    CHECK_THROWS_WITH(ends.model.coverages.react(ends.point("Si", flux, theta), 1.0, theta),
                      Contains("coverage_rates.theta") && Contains("not a number"));
    CHECK_THROWS_WITH(ends.model.coverages.rate(0, ends.point("Si", flux, beyond)),
                      Contains("coverage_rates.theta") && Contains("not a number"));
    // The remedy that the message names.
    const Formulated kept = law("F*max(0, 1 - theta)^0.5");
    theta = beyond;
    kept.model.coverages.react(kept.point("Si", flux, theta), 1.0, theta);
    CHECK(theta[0] == Approx(1.0).epsilon(1e-9));
}

TEST_CASE("the example that the documentation of formula gives is a step") {
    for (const SectionDoc& section : recipe_documentation()) {
        if (section.name != "formula") continue;
        const std::size_t begin = section.more.find("model = \"formula\"");
        REQUIRE(begin != std::string::npos);
        const std::string wafer = kFormulaWafer.substr(0, kFormulaWafer.find("model = "));
        const Recipe recipe = parse_recipe(wafer + section.more.substr(begin), "example.toml");
        const Model model = make_model(recipe.steps.at(0), recipe.materials, recipe.domain);
        CHECK(flux_names(model.species) == std::vector<std::string>{"F", "ion", "ion_sputter"});
        for (const std::string& function : expression_functions())
            CHECK_THAT(section.more, Contains(function));
        return;
    }
    FAIL("there is no formula");
}

TEST_CASE("a formula's effective recipe reads back equal, and its keys are settable") {
    const std::string text = kFormulaWafer + rate("-k*F") + "time_steps = 7\n";
    const Recipe recipe = parse_recipe(text, "step.toml", {"step[0].parameters.k=0.5"});
    const Model model = make_model(recipe.steps[0], recipe.materials, recipe.domain);
    CHECK(model.min_time_steps == 7);
    const std::vector<double> flux{2.0, 1.0}, theta{0.0};
    CHECK(model.speed({0, flux, Vec3::UnitZ(), true, theta}) == -1.0);
    Recipe again = parse_recipe(effective_recipe(recipe), "effective.toml");
    again.file = recipe.file;
    again.notes = recipe.notes;
    CHECK(again == recipe);
    const std::string ion = kFormulaWafer + kIon + "angular = \"cos\", scale = { Si = 2 } }] }]\n";
    Recipe yields = parse_recipe(ion, "step.toml");
    Recipe back = parse_recipe(effective_recipe(yields), "step.toml");
    back.notes = yields.notes;
    CHECK(back == yields);
}
