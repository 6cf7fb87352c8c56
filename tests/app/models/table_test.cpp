#include "app/models/table.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "app/process/simulation.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "flux/yield.hpp"
#include "tests/folder.hpp"

// Files with numbers for recipes: functions on grids, and sources of ions.
using namespace sidewall;
using namespace sidewall::app;
using namespace sidewall::test;
using Catch::Matchers::Contains;

namespace {

std::string write(const Folder& folder, const std::string& name, const std::string& text) {
    std::ofstream(folder.path / name, std::ios::binary) << text;
    return (folder.path / name).string();
}

std::string recipe(const std::string& keys) {
    return R"([domain]
extent = [0.4, 0.4]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[flux]
rays = 100000
[simplify]
method = "none"
[[step]]
duration = 1.0
)" + keys;
}

Recipe parsed(const Folder& folder, const std::string& keys) {
    return parse_recipe(recipe(keys), (folder.path / "recipe.toml").string());
}

Model model_of(const Folder& folder, const std::string& keys) {
    const Recipe read = parsed(folder, keys);
    return make_model(read.steps.at(0), read.materials, read.domain);
}

const std::string kSource =
    "# two bins\nenergy_from,energy_to,angle_from,angle_to,weight\n50,150,0,6,3\n10, 30,0,20,1\n0,1,0,1,0\n";

}  // namespace

TEST_CASE("a table is linear between the points of its grid and constant beyond, rows in any order") {
    const Folder folder;
    const Table map =
        read_table(write(folder, "map.csv", "y,x,rate\n1,0,2\n0,0,1\r\n\n3,10,9\n0,10,5\n1,10,6\n3,0,0.5\n"));
    CHECK(map(0, 0) == 1.0);
    CHECK(map(3, 10) == 9.0);
    CHECK(map(0.5, 5) == Approx(0.25 * (1 + 2 + 5 + 6)).epsilon(1e-14));
    CHECK(map(2, 2.5) == Approx(0.5 * (0.75 * 2 + 0.25 * 6) + 0.5 * (0.75 * 0.5 + 0.25 * 9)).epsilon(1e-14));
    CHECK(map(-7, 20) == 5.0);
    CHECK(map(7, -20) == 0.5);
    CHECK(std::isnan(map(std::nan(""), 1)));
    const Table line = read_table(write(folder, "line.csv", "a,v\n10,1\n0,3\n"));
    CHECK(line(2.5) == 2.5);
    CHECK(line(-1) == 3.0);
    CHECK(line(99) == 1.0);
    CHECK(read_table(write(folder, "one.csv", "a,v\n10,7\n"))(3) == 7.0);
    // Without headings the first row is data, too. Units become the recipe's.
    CHECK(read_table(write(folder, "bare.csv", "-1,0.9\n0,0.1\n1,0.1\n"))(-1) == 0.9);
    CHECK(read_table(write(folder, "nm.csv", "x [nm];v\n0;1,5\n500;2,5\n"))(0.25) == 2.0);
    CHECK(read_table(write(folder, "slash.csv", "x / nm;v / (nm/s)\n0;1500\n500;2500\n"))(0.25) == 2.0);
    for (const char* heading : {"v [um/hour]", "v [nm/Min]", "v [furlong]", "v [kg/s]", "v/inch"})
        CHECK_THROWS_WITH(read_table(write(folder, "odd.csv", std::string("x,") + heading + "\n0,1\n1,2\n")),
                          Catch::Contains("the unit is unknown"));
    CHECK(read_table(write(folder, "eV.csv", "E [eV],v [1]\n0,1\n100,2\n"))(50.0) == 1.5);
}

TEST_CASE("expressions call tables by name, by place and by angle") {
    const Folder folder;
    write(folder, "map.csv", "x,y,rate\n-1,0,0\n1,0,2\n-1,1,0\n1,1,2\n");
    write(folder, "angular.csv", "degree,yield\n0,1\n60,3\n90,0\n");
    const Model etch = model_of(folder, R"TOML(model = "formula"
tables = [{ name = "map", file = "map.csv" }, { name = "f", file = "angular.csv" }]
species = [{ name = "ion", kind = "ion", yields = [{ name = "y", angular = "f(acos(cos)*180/pi)" }] }]
rate = "-0.5*map(x, y) - ion_y"
)TOML");
    SurfacePoint point;
    const std::vector<double> flux{1.0, 0.25};
    point.flux = flux;
    point.position = Vec3(0.5, 0.3, 0.0);
    CHECK(etch.speed(point) == Approx(-0.5 * 1.5 - 0.25).epsilon(1e-13));
    CHECK(flux::yield_of(etch.species[0].yields[0], 0, true, 50.0, std::cos(std::numbers::pi / 6)) ==
          Approx(2.0).epsilon(1e-9));
}

TEST_CASE("ions of a tabulated source etch at the mean yield of its bins") {
    const Folder folder;
    write(folder, "source.csv", kSource);
    const std::string keys = R"TOML(model = "formula"
species = [{ name = "ion", kind = "ion", source_file = "source.csv", yields = [{ name = "y", angular = "cos^2", energy = "E/100" }] }]
rate = "-0.1*ion_y"
)TOML";
    const Model model = model_of(folder, keys);
    REQUIRE(model.species[0].bins.size() == 2);  // the third bin has no weight
    CHECK(model.species[0].energy.mean == Approx(0.75 * 100.0 + 0.25 * 20.0));
    // The mean of cos^2 over an angle from 0 to a is 1/2 + sin(2a)/(4a).
    const auto cosine = [](double degrees) {
        const double a = degrees * std::numbers::pi / 180.0;
        return 0.5 + std::sin(2.0 * a) / (4.0 * a);
    };
    const double exact = 0.75 * 1.0 * cosine(6.0) + 0.25 * 0.2 * cosine(20.0);
    CHECK(flux::mean_yield(model.species[0], model.species[0].yields[0]) == Approx(exact).epsilon(1e-4));
    RunOptions options;
    options.output = folder.path / "out";
    options.quiet = true;
    const TriangleMesh surface = run_recipe(parsed(folder, keys), options).surface;
    double depth = 0.0;
    for (const Vec3& p : surface.vertices) depth -= p.z() / static_cast<double>(surface.vertices.size());
    // A hit's yield scatters by 0.45 of its mean, and each time step has 1e5 hits. Five standard errors.
    CHECK(depth == Approx(0.1 * exact).epsilon(5.0 * 0.45 / std::sqrt(1e5)));
}

TEST_CASE("neutrals come from the angles that a table says, exactly") {
    const Folder folder;
    // Intensity per solid angle, linear between its rows: a sputter target's, with its maximum at 40 degrees.
    write(folder, "curve.csv", "angle,intensity\n0,0.6\n40,1\n70,0.4\n90,0\n");
    const auto intensity = [](double degree) {
        return degree < 40.0   ? 0.6 + 0.4 * degree / 40.0
               : degree < 70.0 ? 1.0 - 0.6 * (degree - 40.0) / 30.0
                               : 0.4 - 0.4 * (degree - 70.0) / 20.0;
    };
    const Model model =
        model_of(folder,
                 "model = \"multi_particle\"\nspecies = [{ name = \"Ti\", rate = -0.1, source_file = "
                 "\"curve.csv\" }]\n");
    const flux::Species& species = model.species[0];
    CHECK(species.energy.mean == 0.0);
    CHECK(flux::only_reemits_diffusely(species));
    CHECK(flux::why_not_radiosity(species) == "its source is no cos^n");
    CHECK_FALSE(flux::same_paths(species, {"other", 1.0, {1.0}}));
    // Chi-square of 45 bins of 2 degrees, against the integral of intensity times sine.
    constexpr int kBins = 45, kSamples = 400'000;
    std::vector<double> counts(kBins, 0.0), shares(kBins, 0.0);
    for (std::uint64_t i = 0; i < kSamples; ++i) {
        const flux::Draws d = flux::draw(flux::random_key(3, 0, 0), i, 0);
        const auto [direction, energy] =
            flux::sample_bins(species.bins, -Vec3::UnitZ(), d.uniform(0), d.uniform(1), d.uniform(2));
        CHECK_FALSE(energy != 0.0);
        counts[static_cast<std::size_t>(std::acos(-direction.z()) * 180.0 / std::numbers::pi / 2.0)] += 1.0;
    }
    double all = 0.0;
    for (int b = 0; b < kBins; ++b)
        for (int k = 0; k < 1000; ++k) {
            const double degree = 2.0 * (b + (k + 0.5) / 1000.0);
            const double part = intensity(degree) * std::sin(degree * std::numbers::pi / 180.0);
            shares[static_cast<std::size_t>(b)] += part;
            all += part;
        }
    double chi = 0.0;
    for (std::size_t b = 0; b < kBins; ++b) {
        const double expected = kSamples * shares[b] / all;
        chi += (counts[b] - expected) * (counts[b] - expected) / expected;
    }
    CHECK(chi < 44.0 + 4.0 * std::sqrt(2.0 * 44.0));

    // A histogram: its weights, uniform over each bin's angle; angles below the first count as the first's.
    write(folder, "bins.csv", "angle_to,weight,angle_from\n20,3,10\n60,1,40\n5,0,0\n");
    const auto bins = read_source_angles(folder.path / "bins.csv");
    REQUIRE(bins.size() == 2);
    CHECK(bins[0].until == 0.75);
    CHECK(bins[1].angle_from == Approx(40.0 * std::numbers::pi / 180.0));
    // A flat wafer etches at its rate, whatever the angles of the source.
    RunOptions options;
    options.output = folder.path / "out";
    options.quiet = true;
    const TriangleMesh surface =
        run_recipe(
            parsed(
                folder,
                "model = \"multi_particle\"\nspecies = [{ name = \"a\", rate = -0.1, source_file = "
                "\"bins.csv\" }, { name = \"b\", rate = -0.1, source_beta = -0.8, pressure = 100, sticking = "
                "0.2 }]\n"),
            options)
            .surface;
    double depth = 0.0;
    for (const Vec3& p : surface.vertices) depth -= p.z() / static_cast<double>(surface.vertices.size());
    CHECK(depth == Approx(0.2).epsilon(3e-3));
}

TEST_CASE("a run takes a source that check takes: weights lost in the sum, angles next to 90 degrees") {
    const Folder folder;
    const std::string table =
        write(folder, "s.csv",
              "angle_from,angle_to,weight\n0,1,1e-320\n0,10,1e10\n10,20,1e-10\n30,89.9999999999,3e10\n");
    const auto bins = read_source_angles(table);
    REQUIRE(bins.size() == 2);
    CHECK(bins[0].angle_to == Approx(10.0 * std::numbers::pi / 180.0));
    CHECK(bins[0].until == 0.25);
    CHECK(bins[1].until == 1.0);
    RunOptions options;
    options.output = folder.path / "out";
    options.quiet = true;
    CHECK_NOTHROW(
        run_recipe(parsed(folder,
                          "model = \"multi_particle\"\nspecies = [{ name = \"a\", rate = -0.1, source_file = "
                          "\"s.csv\" }]\n"),
                   options));
}

TEST_CASE("files that are no tables or sources are refused by name and line", "[foreign]") {
    const Folder folder;
    const auto table = [&](const std::string& text) { return read_table(write(folder, "t.csv", text)); };
    const auto source = [&](const std::string& text) { return read_source(write(folder, "s.csv", text)); };
    const std::string head = "energy_from,energy_to,angle_from,angle_to,weight\n";
    CHECK_THROWS_WITH(table(""), Contains("t.csv: holds no row of numbers"));
    CHECK_THROWS_WITH(table("x,y\n"), Contains("no row of numbers"));
    CHECK_THROWS_WITH(table("x,y\n1,2\n3\n"), Contains("t.csv:3: 1 values in a table of 2 columns"));
    CHECK_THROWS_WITH(table("x,y\n1,two\n"), Contains("t.csv:2: \"two\" in y is not a finite number"));
    CHECK_THROWS_WITH(table("x,y\n1,nan\n"), Contains("not a finite number"));
    CHECK_THROWS_WITH(table("x,y\n1,1e999\n"), Contains("not a finite number"));
    CHECK_THROWS_WITH(table("x\n1\n"), Contains("1 columns"));
    CHECK_THROWS_WITH(table("a,b,c,d\n1,2,3,4\n"), Contains("4 columns"));
    CHECK_THROWS_WITH(table("x,v\n1,2\n1,3\n"), Contains("every combination once"));
    CHECK_THROWS_WITH(table("x,y,v\n1,1,2\n1,2,3\n2,1,3\n"), Contains("2 by 2"));
    CHECK_THROWS_WITH(table("x,y,v\n1,1,2\n1,1,3\n2,1,3\n2,2,1\n"), Contains("two values at x = 1, y = 1"));
    CHECK_THROWS_WITH(read_table(folder.path / "none.csv"), Contains("no such file"));
    CHECK_THROWS_WITH(source("energy_from,energy_to,angle_from,angle_too,weight\n1,2,3,4,5\n"),
                      Contains("no column angle_to"));
    CHECK_THROWS_WITH(source(head + "10,5,0,1,1\n"), Contains("row 1"));
    CHECK_THROWS_WITH(source(head + "1,5,0,1,1\n1,5,0,95,1\n"), Contains("row 2"));
    CHECK_THROWS_WITH(source(head + "1,5,0,1,-1\n"), Contains("row 1"));
    CHECK_THROWS_WITH(source(head + "1,5,0,1,0\n"), Contains("add up to 0: give rows of a"));
    CHECK_THROWS_WITH(source(head + "1,5,0,1,1e308\n5,9,0,1,1e308\n"),
                      Contains("add up to inf: give smaller"));
    CHECK_THROWS_WITH(source("energy_from,energy_to,angle_from,angle_to,weight,weight\n1,5,0,1,1,2\n"),
                      Contains("has more than one column weight"));

    const auto angles = [&](const std::string& text) {
        return read_source_angles(write(folder, "a.csv", text));
    };
    CHECK_THROWS_WITH(angles("angle_from,weight\n1,2\n"),
                      Contains("no column angle_to; a source has angle_from"));
    CHECK_THROWS_WITH(angles("intensity,degree\n1,2\n"), Contains("no column angle;"));
    CHECK_THROWS_WITH(angles("angle_from,angle_to,weight\n0,90,1\n"), Contains("row 1"));
    CHECK_THROWS_WITH(angles("angle_from,angle_to,weight\n0,9,0\n"), Contains("add up to 0"));
    CHECK_THROWS_WITH(angles("angle [rad],intensity\n0,1\n1,1\n"), Contains("angle is in rad"));
    CHECK_THROWS_WITH(angles("angle,intensity\n0,1\n50,1\n40,1\n"), Contains("row 3: angles must rise"));
    CHECK_THROWS_WITH(angles("angle,intensity\n0,1\n50,-1\n"), Contains("row 2"));
    CHECK_THROWS_WITH(angles("angle,intensity\n0,1\n95,1\n"), Contains("row 2"));
    CHECK_THROWS_WITH(angles("angle,intensity\n0,0\n50,0\n"), Contains("add up to 0"));
    CHECK_THROWS_WITH(angles("angle,intensity\n0,1\n"), Contains("add up to 0"));

    write(folder, "source.csv", kSource);
    const auto species = [&](const std::string& keys) {
        return model_of(
            folder, "model = \"multi_particle\"\nspecies = [{ name = \"a\", rate = -1.0, " + keys + " }]\n");
    };
    CHECK(species("kind = \"ion\", source_file = \"source.csv\"").species[0].bins.size() == 2);
    CHECK_THROWS_WITH(species("source_file = \"source.csv\""),
                      Contains("source.csv: has energies, which only ions have"));
    CHECK_THROWS_WITH(species("kind = \"ion\", source_file = \"sauce.csv\""),
                      Contains("species[0].source_file") && Contains("no such file"));
    CHECK_THROWS_WITH(species("kind = \"ion\", energy = 5.0, source_file = \"source.csv\""),
                      Contains("species[0].energy") && Contains("source_file"));
    const auto formula = [&](const std::string& keys) {
        return model_of(folder, "model = \"formula\"\n" + keys);
    };
    const std::string map = "tables = [{ name = \"map\", file = \"map.csv\" }]\n";
    CHECK_THROWS_WITH(formula(map + "rate = -1\n"), Contains("tables[0].file") && Contains("no such file"));
    write(folder, "map.csv", "x,v\n0,1\n1,2\n");
    CHECK_THROWS_WITH(formula(map + "rate = \"-map(x, y)\"\n"), Contains("too many parameters"));
    CHECK_THROWS_WITH(formula(map + "rate = \"-mapp(x)\"\n"), Contains("did you mean map?"));
    CHECK(parsed(folder, "model = \"formula\"\n" + map + "rate = \"-map(x)\"\n").notes ==
          std::vector<std::string>{"step[0].tables[0].file: 2 rows of 2 between commas, headings x, v"});
    CHECK_THROWS_WITH(formula(map + "rate = -1\nparameters = { map = 1 }\n"), Contains("name of another"));
}
