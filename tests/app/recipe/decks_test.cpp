#include <fmt/format.h>
#include <fmt/ranges.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "app/common/json.hpp"
#include "app/evaluation/validate_chart.hpp"
#include "app/fit/fit_profile.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/process/simulation.hpp"
#include "app/process/state.hpp"
#include "app/recipe/decks.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/node_path.hpp"
#include "app/recipe/notes.hpp"
#include "app/recipe/steps.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/folder.hpp"

// Chemistry decks: the figures that their heads promise, and their use in recipes.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

// An expected figure from a deck's head, and the value that the deck's numbers give.
struct Figure {
    std::string what, source, role;
    double value = 0.0, bar = 0.0, got = NAN;
};

std::string wafer(const std::set<std::string>& materials, const std::string& length,
                  const std::string& time) {
    std::string text = fmt::format(
        "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\nlength_unit = \"{}\"\ntime_unit = \"{}\"\n", length,
        time);
    for (const std::string& material : materials)
        text += fmt::format("[[layer]]\nmaterial = \"{}\"\n{}", material,
                            text.find("[[layer]]") == std::string::npos ? "" : "thickness = 0.5\n");
    return text;
}

double rate_on(const Recipe& recipe, const std::string& material) {
    for (const StepMaterials& here : materials_by_step(recipe))
        for (const BlanketRate& at : blanket_rates(here))
            if (recipe.materials[static_cast<std::size_t>(at.material)].name == material) {
                INFO(at.unknown);
                REQUIRE(at.unknown.empty());
                return at.rate;
            }
    return NAN;
}

std::vector<Figure> figures_of(const Deck& deck) {
    const toml::table& head = deck.tables;
    const auto text = [&](const toml::table& table, const char* key, const char* fallback) {
        return table[key].value<std::string>().value_or(fallback);
    };
    std::vector<Figure> figures;
    const toml::array* expected = head["expected"].as_array();
    REQUIRE(expected != nullptr);
    for (const toml::node& node : *expected) {
        const toml::table& row = *node.as_table();
        const std::string material = text(row, "material", ""), over = text(row, "over", "");
        const std::string &length = deck.units.length, &time = deck.units.time;
        std::set<std::string> materials{"Si", material};
        if (deck.model == "fluorocarbon") materials.erase("Si");
        if (!over.empty()) materials.insert(over);
        std::vector<std::string> overrides;
        std::string conditions;
        if (const toml::table* with = row["with"].as_table())
            for (const auto& [key, value] : *with) {
                const double number = value.value<double>().value();
                overrides.push_back(fmt::format("step[0].{}={}", key.str(), number));
                conditions += fmt::format("{}{} {:g}", conditions.empty() ? " at " : ", ", key.str(), number);
            }
        const Recipe recipe = parse_recipe(
            wafer(materials, length, time) +
                fmt::format("[[step]]\nchemistry = \"{}\"\nduration = 1.0\n", deck.file.string()),
            "deck.toml", overrides);
        Figure figure{"", text(row, "source", ""), text(row, "role", ""),
                      row[over.empty() ? "rate" : "selectivity"].value<double>().value(),
                      row["bar"].value<double>().value()};
        figure.got = rate_on(recipe, material);
        if (over.empty()) {
            figure.what = fmt::format("{}, {}/{}{}", material, length, time, conditions);
        } else {
            figure.got /= rate_on(recipe, over);
            figure.what = fmt::format("{} : {}{}", material, over, conditions);
        }
        figures.push_back(figure);
    }
    return figures;
}

Recipe with_deck(const std::string& step, const std::vector<std::string>& overrides = {}) {
    return parse_recipe(wafer({"Si", "SiO2"}, "um", "s") + "[[step]]\nduration = 1.0\n" + step,
                        "with_deck.toml", overrides);
}

}  // namespace

TEST_CASE("every deck's blanket rates and selectivities lie within the bars of its sources") {
    const std::vector<Deck> decks = shipped_decks();
    CHECK(decks.size() >= 15);
    for (const Deck& deck : decks) {
        INFO(deck.name);
        CHECK_FALSE(deck.sources.empty());
        CHECK_FALSE(deck.holds.empty());
        CHECK(deck.tables.contains("range"));
        const std::vector<Figure> figures = figures_of(deck);
        CHECK_FALSE(figures.empty());
        for (const Figure& figure : figures) {
            INFO(figure.what << ": " << figure.got << ", asked " << figure.value << " +- " << figure.bar);
            CHECK_FALSE(figure.source.empty());
            CHECK_THAT(std::vector<std::string>({"", "same number", "fitted", "held out"}),
                       Catch::Matchers::VectorContains(figure.role));
            CHECK(figure.bar < 0.5 * std::abs(figure.value));
            CHECK(std::abs(figure.got - figure.value) <= figure.bar);
        }
    }
}

// Picture of a deck's effect on an opening 1 um wide in a mask 0.3 um thick, or on a trench 1.5 um deep: the
// surface before and after a step that takes 0.5 um from a flat wafer, or brings 0.25 um.
std::string picture_of(const Deck& deck) {
    const toml::table& row = *deck.tables["expected"].as_array()->get(0)->as_table();
    const std::string material = row["material"].value<std::string>().value();
    const bool grows = row["rate"].value<double>().value() > 0.0;
    const auto recipe = [&](double duration) {
        return parse_recipe(
            fmt::format("[domain]\nextent = [3.0]\ngrid_spacing = 0.05\n[[layer]]\nmaterial = \"{}\"\n{}"
                        "[[step]]\nchemistry = \"{}\"\nduration = {:.6e}\n",
                        grows ? "Si" : material,
                        grows ? "shape = \"trench\"\nwidth = 1.0\ndepth = 1.5\n"
                              : "[[layer]]\nmaterial = \"Mask\"\nshape = \"trench\"\nthickness = 0.3\n"
                                "width = 1.0\n",
                        deck.file.string(), duration),
            "picture.toml");
    };
    const Recipe whole = recipe((grows ? 0.25 : 0.5) / std::abs(rate_on(recipe(1.0), material)));
    const test::Folder folder;
    run_recipe(whole, {.output = folder.path, .quiet = true});
    const MeasuredProfile frame{.name = "", .points = {{-1.5, grows ? -1.6 : -1.0}, {1.5, 0.5}}};
    Json chart = chart_of_profile(contour_of(folder.path, whole, {}), frame, "um");
    const Json before = chart_of_profile(contour_of(folder.path, whole, 0.0), frame, "um");
    chart["title"] = deck.name;
    chart["series"][0]["name"] = "after";
    chart["series"][1] = {{"name", "before"}, {"points", before["series"][0]["points"]}};
    return chart_svg(chart);
}

// The guide's sentence on how many of the decks' figures are independent evidence.
std::string counts_of(const std::vector<std::vector<Figure>>& decks) {
    std::map<std::string, int> by_role;
    int all = 0;
    for (const std::vector<Figure>& figures : decks)
        for (const Figure& figure : figures) ++by_role[figure.role], ++all;
    return fmt::format(
        "\nOf {} figures of {} decks {} are of another measurement than the deck's numbers, or of another film or "
        "tool, and {} were held out. {} are the same number that the deck was given: they show that the program "
        "gives back what its deck says, and prove nothing of the wafer. To {} a number of the deck was fitted.\n",
        all, decks.size(), by_role[""], by_role["held out"], by_role["same number"], by_role["fitted"]);
}

// The guide's section on a deck.
std::string section_of(const Deck& deck, const std::vector<Figure>& figures) {
    std::string text = fmt::format("## {}\n\n{}. Model `{}`.\n\n", deck.name, deck.title, deck.model);
    text += fmt::format("![{0}](chemistry/{0}.svg)\n\n", deck.name);
    for (const std::string& source : deck.sources) text += fmt::format("- {}\n", source);
    if (const toml::table* ranges = deck.tables["range"].as_table()) {
        std::string list;
        for (const auto& [key, range] : *ranges)
            list += fmt::format("{}`{}` {:g} to {:g}", list.empty() ? "" : ", ", key.str(),
                                range.as_array()->get(0)->value<double>().value(),
                                range.as_array()->get(1)->value<double>().value());
        text += fmt::format("\nHolds for {}. A note tells when a step leaves {}.\n", deck.holds, list);
    }
    text += "\n| figure | deck | source | bar | role | of |\n|---|---|---|---|---|---|\n";
    for (const Figure& figure : figures)
        text += fmt::format("| {} | {:.3g} | {:g} | {:g} | {} | {} |\n", figure.what, figure.got,
                            figure.value, figure.bar, figure.role, figure.source);
    return text;
}

TEST_CASE("the guide's page of chemistries holds what the decks say and give") {
    const std::filesystem::path page = std::filesystem::path(SIDEWALL_SOURCE_DIR) / "docs/chemistry.md";
    const std::string written = surface::read_whole_file(page),
                      mark = "<!-- The rest is made from configs/chemistry: see CONTRIBUTING.md -->\n";
    const std::size_t at = written.find(mark);
    REQUIRE(at != std::string::npos);
    std::string text = written.substr(0, at) + mark;
    const bool write = std::getenv("SIDEWALL_WRITE_DOCS") != nullptr;
    const std::vector<Deck> decks = shipped_decks();
    std::vector<std::vector<Figure>> figures(decks.size());
    std::ranges::transform(decks, figures.begin(), figures_of);
    text += counts_of(figures);
    for (std::size_t k = 0; k < decks.size(); ++k) {
        const Deck& deck = decks[k];
        const std::filesystem::path picture =
            page.parent_path() / "chemistry" / fmt::format("{}.svg", deck.name);
        if (write) std::ofstream(picture) << picture_of(deck);
        text += "\n" + section_of(deck, figures[k]);
        CHECK_THAT(surface::read_whole_file(picture), Contains("<title>" + deck.name + "</title>"));
    }
    if (write) std::ofstream(page) << text;
    CHECK(surface::read_whole_file(page) == text);
}

TEST_CASE("keys of a step win over its deck's, by material and under another word, too") {
    const std::string deck =
        "chemistry = \"c4f8_ar_oxide\"\nenhanced_yield = { Si = 0.01, oxide = 0.05 }\nenergy = 80.0\n";
    const Recipe recipe = with_deck("model = \"fluorocarbon\"\n" + deck);
    const std::string text = effective_recipe(recipe);
    CHECK_THAT(text, Contains("SiO2 = 0.05") && Contains("Si = 0.01") && Contains("energy = 80.0") &&
                         Contains("removal_yield = 0.1444") && !Contains("0.0361 }"));
    // The stored recipe needs no deck and names only materials of its wafer.
    CHECK_THAT(text, !Contains("chemistry") && !Contains("Resist") && !Contains("Si3N4"));
    CHECK(effective_recipe(parse_recipe(text, "stored.toml")) == text);
    CHECK_THAT(effective_recipe(with_deck(deck)), Contains("model = \"fluorocarbon\""));
    const auto all = with_deck("chemistry = \"c4f8_ar_oxide\"\nenhanced_yield = 0.02\n");
    CHECK_THAT(effective_recipe(all), Contains("enhanced_yield = 0.02"));

    const Recipe set =
        with_deck("chemistry = \"cl_si\"\n", {"step[0].chemistry=cl_ar_si", "step[0].species[1].energy=60"});
    CHECK_THAT(effective_recipe(set), Contains("energy = 60.0") && Contains("0.59*(sqrt(E) - 4)"));
    CHECK(written_number("[[step]]\nchemistry = \"sf6_o2_si\"\n", "fit.toml", {}, "step[0].energy") == 140.0);
}

TEST_CASE("a step that an override puts in another's place has its deck once, or none") {
    const auto with = [](const std::string& setting) {
        return parse_recipe(
            wafer({"Si"}, "um", "min") + "[[step]]\nchemistry = \"bosch_etch\"\nduration = 0.01\n",
            "set.toml", {setting});
    };
    const double once = rate_on(with("step[0].duration=0.01"), "Si");
    CHECK(rate_on(with("step[0]={chemistry=\"bosch_etch\",duration=0.01}"), "Si") == Approx(once));
    const Recipe plain = with("step[0]={model=\"isotropic\",rate=-1.0,duration=0.01}");
    CHECK(rate_on(plain, "Si") == Approx(-1.0));
    CHECK_THAT(fmt::format("{}", fmt::join(plain.notes, "\n")), !Contains("bosch_etch"));
}

TEST_CASE("a deck's lengths and times are converted into the recipe's") {
    const auto rates = [](const char* length, const char* time, const char* deck) {
        const Recipe recipe = parse_recipe(
            wafer({"Si"}, length, time) + fmt::format("[[step]]\nchemistry = \"{}\"\nduration = 1.0\n", deck),
            "units.toml");
        return rate_on(recipe, "Si");
    };
    CHECK(rates("um", "min", "koh_30_70c") == Approx(-0.797));
    CHECK(rates("nm", "s", "koh_30_70c") == Approx(-797.0 / 60.0));
    CHECK(rates("um", "h", "cl_si") == Approx(3.6 * rates("nm", "s", "cl_si")));  // expressions
    CHECK(rates("um", "min", "bosch_etch") ==
          Approx(0.06 * rates("nm", "s", "bosch_etch")));  // tables of species
    const Recipe ald = parse_recipe(
        wafer({"Si"}, "um", "min") + "[[step]]\nchemistry = \"ald_al2o3\"\nduration = 1.0\n", "ald.toml");
    CHECK(rate_on(ald, "Al2O3") == Approx(0.0264e-3 * 60.0).epsilon(1e-4));
}

TEST_CASE(
    "a step beyond the range of its deck's sources gets a note, and so does a material they do not know") {
    const auto notes = [](const std::string& step) {
        return fmt::format("{}", fmt::join(with_deck(step).notes, "\n"));
    };
    CHECK_THAT(notes("chemistry = \"cl_si\"\n"), Contains("step[0].chemistry cl_si: Chlorine ions") &&
                                                     Contains("; holds for 35 to 100 eV") &&
                                                     !Contains("outside"));
    CHECK_THAT(notes("chemistry = \"koh_30_70c\"\nr100 = 0.02\n"),
               Contains("step[0].r100 = 0.02 lies outside 0.0125 to 0.0140833"));
    // A deck's number for a material that is not on the wafer is not missed by the step.
    CHECK_THAT(notes("chemistry = \"bosch_etch\"\n"), !Contains("gives no number"));
    CHECK_THAT(notes("chemistry = \"chf3_cf4_oxide\"\n"), !Contains("directional.PolySi"));
    CHECK_THAT(with_deck("chemistry = \"cl_si\"\n", {"step[0].species[1].energy=400"}).notes.back(),
               Contains("step[0].species[1].energy = 400 lies outside 35 to 100"));
    CHECK_THAT(notes("chemistry = \"sf6_o2_si\"\netchant_flux = 2200.0\n"),
               Contains("step[0].etchant_flux/ion_flux = 100 lies outside 300 to 2400"));
    CHECK_THAT(notes("chemistry = \"cf2_ar_oxide\"\n"),
               Contains("step[0].rate: chemistry cf2_ar_oxide has no number for Si"));
    // Where the model has no default either, the recipe must give the value.
    CHECK_THROWS_WITH(with_deck("chemistry = \"c4f8_ar_oxide\"\n"), Contains("no value for Si"));
    CHECK_THROWS_WITH(
        parse_recipe(wafer({"Ge"}, "um", "s") + "[[step]]\nchemistry = \"hf_vapor_oxide\"\nduration = 1.0\n",
                     "ge.toml"),
        Contains("ge.toml:") && Contains("step[0].rate: chemistry hf_vapor_oxide has numbers for PolySi, Si, "
                                         "Si3N4, SiO2, W, none of which is on this wafer"));
}

TEST_CASE("the range of a deck is in its units, and tells what is no number or lies in a table by material") {
    const test::Folder folder;
    const auto notes = [&](const std::string& deck, const std::string& step) {
        std::ofstream(folder.path / "own.toml")
            << "title = \"mine\"\nlength_unit = \"nm\"\ntime_unit = \"min\"\n"
            << deck;
        const Recipe recipe = parse_recipe(
            wafer({"Si"}, "um", "s") + "[[step]]\nchemistry = \"own.toml\"\nduration = 1.0\n" + step,
            (folder.path / "recipe.toml").string());
        return fmt::format("{}", fmt::join(recipe.notes, "\n"));
    };
    const std::string rates =
        "range = { \"rate.Si\" = [-120.0, -30.0] }\n[step]\nmodel = \"isotropic\"\nrate = { Si = -60.0 }\n";
    CHECK_THAT(notes(rates, ""), !Contains("outside"));
    CHECK_THAT(notes(rates, "rate = { Si = -0.01 }\n"),
               Contains("step[0].rate.Si = -0.01 lies outside -0.002 to -0.0005"));
    const std::string fluxes =
        "range = { \"etchant_flux/ion_flux\" = [1.0, 10.0] }\n[step]\nmodel = \"sf6_o2\"\netchant_flux = 0.0\n";
    CHECK_THAT(notes(fluxes + "ion_flux = 0.0\n", ""),
               Contains("step[0].etchant_flux/ion_flux gives no number") && Contains("1 to 10"));
    CHECK_THAT(notes("range = { \"parameters.k\" = [1.0, 2.0] }\n[step]\nmodel = \"formula\"\n"
                     "parameters = { k = \"1 + 4\" }\nrate = { Si = \"-k\" }\n",
                     ""),
               Contains("step[0].parameters.k gives no number"));
}

TEST_CASE("a wrong deck is refused by its file and line, and an unknown one with those there are") {
    const auto refused = [](const std::string& step, const std::string& words) {
        CHECK_THROWS_WITH(with_deck(step), Contains(words));
    };
    refused("chemistry = \"cl_sl\"\n",
            "no chemistry has that name: did you mean cl_si? There are ald_al2o3, ");
    refused("chemistry = 3\n", "must be a string");
    refused("chemistry = \"none.toml\"\n", "no such file");
    refused("model = \"isotropic\"\nchemistry = \"cl_si\"\n", "chemistry cl_si is of model \"formula\"");
    refused("chemistry = \"cl_si\"\nsteps = [{ model = \"isotropic\", rate = -1.0, duration = 1.0 }]\n",
            "unknown key of a loop");

    const test::Folder folder;
    const auto own = [&](const std::string& deck, const std::string& words) {
        std::ofstream(folder.path / "own.toml") << deck;
        CHECK_THROWS_WITH(
            parse_recipe(wafer({"Si"}, "nm", "s") +
                             "[[step]]\nchemistry = \"own.toml\"\nmodel = \"isotropic\"\nduration = 1.0\n",
                         (folder.path / "recipe.toml").string()),
            Contains(words));
    };
    own("title = \"mine\"\n[step]\nmodel = \"isotropic\"\nrate = true\n",
        "own.toml:4: step[0].rate = true: must be a number");
    own("title = \"mine\"\n[step]\nmodel = \"isotropic\"\nrates = 1.0\n", "own.toml:4: step[0].rates");
    own("title = \"mine\"\n[step]\nmodel = \"isotropic\"\nrate = -1\n", "with a decimal point");
    own("titel = \"mine\"\n",
        "own.toml:1: chemistry.titel = \"mine\": unknown key of a chemistry: did you mean title?");
    own("[step]\nmodel = \"isotropic\"\n", "title: missing");
    own("title = \"mine\"\n[step]\nrate = 1.0\n", "step.model: missing");
    own("title = \"mine\"\nlength_unit = \"ell\"\n[step]\nmodel = \"isotropic\"\n",
        "own.toml:2: chemistry.length_unit = \"ell\": must be one of nm, um");
    own("title = \"mine\"\nrange = { rate = 3 }\n[step]\nmodel = \"isotropic\"\n",
        "must be a list of 2 numbers");
    own("title = \"mine\"\nrange = { rate = [3, 1] }\n[step]\nmodel = \"isotropic\"\n", "range.rate");
    own("title = \"mine\"\nrange = 5\n[step]\nmodel = \"isotropic\"\n", "must be a table");
    own("title = \"mine\"\n[step]\nmodel = \"isotropic\"\nchemistry = \"cl_si\"\n", "names no other");
    refused("chemistry = \"../validation/page\"\n", "no chemistry has that name");
    // A synonym names the same material.
    std::ofstream(folder.path / "own.toml")
        << "title = \"mine\"\ntime_unit = \"min\"\n[step]\nmodel = \"isotropic\"\nrate = { silicon = -60.0 }\n";
    const Recipe recipe =
        parse_recipe(wafer({"Si"}, "um", "s") +
                         "[[step]]\nrepeat = 2\n[[step.steps]]\nchemistry = \"own.toml\"\nduration = 1.0\n",
                     (folder.path / "recipe.toml").string());
    CHECK(rate_on(recipe, "Si") == Approx(-1.0));
}

TEST_CASE("a run of a recipe with a deck that is stopped and resumed gives the bits of one that was not") {
    const Recipe recipe =
        parse_recipe(wafer({"Si"}, "um", "min") +
                         "[[layer]]\nmaterial = \"Mask\"\nshape = \"trench\"\nthickness = 0.3\nwidth = 0.8\n"
                         "[[step]]\nchemistry = \"koh_30_70c\"\nduration = 0.5\n",
                     "deck.toml");
    const test::Folder whole, parts;
    run_recipe(recipe, {.output = whole.path, .quiet = true});
    bool stop = false;
    CHECK_THROWS_AS(
        run_recipe(recipe, {.output = parts.path,
                            .quiet = true,
                            .stop = [&] { return stop; },
                            .observe = [&](const Moment& moment) { stop = moment.state.time > 0.2; }}),
        Interrupted);
    run_recipe(recipe, {.output = parts.path, .resume = true, .quiet = true});
    CHECK_THAT(surface::read_whole_file(parts.path / "summary.json"),
               Contains("\"chemistry\": \"koh_30_70c\""));
    for (const char* name : {"recipe.toml", "timeline.csv", "surface_0001.vtp"})
        CHECK(surface::read_whole_file(parts.path / name) == surface::read_whole_file(whole.path / name));
}
