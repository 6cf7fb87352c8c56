#include <catch2/catch.hpp>

#include "app/recipe/notes.hpp"

// Parts of a recipe that have no effect are noted, and no others.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

const std::string kIdleDomain = R"([domain]
extent = [2.0, 0.4]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
)";
const std::string kEtch = "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\n";

std::string notes(const std::string& rest) {
    std::string text;
    for (const std::string& note : notes_on(parse_recipe(kIdleDomain + rest, "idle.toml")))
        text += note + "\n";
    return text;
}

std::string layer(const std::string& keys) {
    return "[[layer]]\n" + keys;
}

}  // namespace

TEST_CASE("a layer that those below hide wholly is noted") {
    const std::string etch = kEtch + "rate = -0.1\n", oxide = layer("material = \"SiO2\"\ntop = 0.5\n");
    CHECK_THAT(notes(oxide + layer("material = \"Si3N4\"\ntop = 0.5\n") + etch),
               Contains("layer[2] does nothing: Si3N4 reaches up to z = 0.5"));
    CHECK_THAT(notes("top = 1.0\n" + layer("material = \"SiO2\"\ntop = 0.0\n") + etch),
               Contains("layer[1] does nothing: SiO2"));
    CHECK_THAT(notes(layer("material = \"SiO2\"\nthickness = 0.0\n") + etch),
               Contains("layer[1] does nothing"));
    CHECK_THAT(notes(oxide + layer("shape = \"cylinder\"\nmaterial = \"W\"\nradius = 0.2\nz = 0.2\n") + etch),
               Contains("layer[2] does nothing: W reaches up to z = 0.4"));
    // A plane at the height of a trench's mouth fills the trench, and a shape that sticks out has an effect.
    const std::string trench =
        layer("shape = \"trench\"\nmaterial = \"SiO2\"\ntop = 0.5\nwidth = 0.6\ndepth = 0.4\n");
    CHECK(notes(trench + layer("material = \"W\"\ntop = 0.5\n") + etch).empty());
    CHECK(notes(oxide + layer("shape = \"fin\"\nmaterial = \"W\"\nwidth = 0.6\nheight = 0.4\n") + etch)
              .empty());
    CHECK(notes(oxide + layer("shape = \"cylinder\"\nmaterial = \"W\"\nradius = 0.4\nz = 0.2\n") + etch)
              .empty());
    CHECK_THAT(notes(trench + layer("material = \"W\"\ntop = 0.1\n") + etch),
               Contains("layer[2] does nothing"));
}

TEST_CASE("values of a material that the step does not meet are noted, if they differ from all others'") {
    CHECK_THAT(notes(kEtch + "rate = { SiO2 = -0.5 }\n"),
               Contains("step[0].rate does nothing for SiO2: not on the wafer"));
    CHECK(notes(kEtch + "rate = { Si = -0.5, Mask = 0.0 }\n").empty());
    CHECK(notes(kEtch + "rate = { Si = 0.5 }\ndeposit = \"SiO2\"\n" + kEtch + "rate = { SiO2 = -0.5 }\n")
              .empty());
    CHECK_THAT(
        notes(
            "[[step]]\nmodel = \"multi_particle\"\nduration = 1.0\nspecies = [{ name = \"n\", rate = { Si = -0.1, "
            "W = -0.2 } }]\n"),
        Contains("step[0].species[0].rate does nothing for W"));
    CHECK_THAT(
        notes("[[step]]\nmodel = \"formula\"\nduration = 1.0\nrate = { Si = -0.1, W = \"-0.2*pi\" }\n"),
        Contains("step[0].rate does nothing for W"));
    // Built-in values for materials that are not on the wafer are not noted.
    CHECK(notes("[[step]]\nmodel = \"sf6_o2\"\nduration = 1.0\n").empty());
}

TEST_CASE("a fill below the wafer and stops that nothing meets are noted") {
    const std::string fill = "[[step]]\nmodel = \"fill\"\nmaterial = \"SiO2\"\nheight = ";
    CHECK_THAT(notes(fill + "-5.0\n"), Contains("step[0].height = -5 lies below the whole wafer"));
    CHECK_THAT(notes(fill + "0.0\n"), Contains("fills nothing"));
    CHECK(notes(fill + "0.1\n").empty());
    CHECK(notes(kEtch + "rate = -0.1\n" + fill + "-0.05\n").empty());  // the etch may have gone deeper
    CHECK_THAT(notes(kEtch + "rate = -0.5\nstop_thickness = 0.5\n"),
               Contains("step[0].stop_thickness never ends the step, which grows no film"));
    CHECK(notes(kEtch + "rate = 0.5\ndeposit = \"SiO2\"\nstop_thickness = 0.3\n").empty());
    CHECK_THAT(notes(kEtch + "rate = -0.5\nstop_material = \"W\"\n"),
               Contains("stop_material never ends the step"));
}

TEST_CASE("a wafer in space that is the same along y, or round, is told what would be cheaper") {
    const auto form = [](const std::string& rest, const std::vector<std::string>& settings) {
        return cheaper_form(
            parse_recipe(kIdleDomain + rest + kEtch + "rate = -0.1\n", "strip.toml", settings));
    };
    const auto note = [&](const std::string& rest) { return form(rest, {}); };
    CHECK_THAT(note(""), Contains("The strip of 0.4 um is the same along y and runs as a profile"));
    const std::vector<std::string> in_space = {"domain.strip=\"space\""}, wider = {"domain.extent=[2, 1]"};
    CHECK_THAT(form("", in_space), Contains("extent = [2] in [domain] makes it a profile"));
    CHECK_THAT(form("shape = \"trench\"\nwidth = 0.8\ndepth = 0.5\n", in_space), Contains("in place of 4"));
    CHECK_THAT(form("", wider), Contains("in place of 10"));
    CHECK(form("[metrology]\nmeasures = [\"lwr_at_0.1\"]\n", {}).find("runs as") == std::string::npos);
    CHECK(note("shape = \"box\"\nsize = [0.8, 0.2]\nheight = 0.5\n").empty());
    CHECK(note("[metrology]\ncut = \"x=0\"\n").empty());
    const std::string square =
        "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = \"hole\"\n"
        "radius = 0.5\ndepth = 0.5\n" +
        kEtch + "rate = -0.1\n";
    CHECK_THAT(cheaper_form(parse_recipe(square, "round.toml")), Contains("symmetry = \"axial\""));
    // The form that the note suggests needs no further note.
    const std::vector<std::string> flat = {"domain.extent=[2]"};
    CHECK(cheaper_form(parse_recipe(kIdleDomain + kEtch + "rate = -0.1\n", "strip.toml", flat)).empty());
}
