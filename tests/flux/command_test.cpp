#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>

#include "flux/radiosity/method_choice.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

std::string slurp(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

// A temporary folder in which the program runs, removed afterwards.
struct Workshop {
    std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("sidewall_flux_" + std::to_string(getpid()));
    Workshop() { std::filesystem::create_directories(folder); }
    ~Workshop() { std::filesystem::remove_all(folder); }

    struct Outcome {
        int code;
        std::string out, error;
    };
    Outcome run(const std::string& arguments) const {
        const std::string command = "cd '" + folder.string() + "' && '" SIDEWALL_PROGRAM "' flux " +
                                    arguments + " > out.txt 2> error.txt";
        const int status = std::system(command.c_str());
        return {WEXITSTATUS(status), slurp(folder / "out.txt"), slurp(folder / "error.txt")};
    }
    void write(const char* name, const TriangleMesh& mesh) const { surface::write_mesh(folder / name, mesh); }
};

// A trench of material 2 between ledges of material 7.
TriangleMesh two_materials() {
    auto mesh = extrude(trench_profile(2.0, 0.5, {0.5}, {0.5}), 1.0, 4);
    Attribute material{"material", 1, Scalar::int32, {}};
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        material.values.push_back(triangle_centroid(mesh, t).z() == 0.0 ? 7 : 2);
    mesh.triangle_attributes.push_back(material);
    return mesh;
}

// A flat disk: a polygon of so many corners.
TriangleMesh disk(std::uint32_t corners) {
    TriangleMesh mesh;
    mesh.vertices.emplace_back(Vec3::Zero());
    for (std::uint32_t k = 0; k < corners; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / corners;
        mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), 0.0);
        mesh.triangles.push_back({0, 1 + k, 1 + (k + 1) % corners});
    }
    return mesh;
}

}  // namespace

TEST_CASE("the flux command writes what the library computes: JSON, CSV and VTP", "[foreign]") {
    const Workshop shop;
    const auto mesh = two_materials();
    shop.write("trench.vtp", mesh);
    const std::string options =
        "--rays 64000 --sticking 2=0.1,7=1 --boundary periodic --seed 5 --source-exponent 3 ";
    const auto csv = shop.run("trench.vtp --json - -o flux.csv " + options);
    CAPTURE(csv.error);
    REQUIRE(csv.code == 0);
    REQUIRE(shop.run("trench.vtp --json flux.json --threads 1 -o flux.vtp " + options).code == 0);

    std::vector<std::int32_t> materials;  // 0: trench, 1: ledge
    for (const double id : mesh.triangle_attribute("material")->values) materials.push_back(id == 7 ? 1 : 0);
    const auto expected = trace(mesh, {Boundary::periodic, Boundary::periodic}, {"test", 3.0, {0.1, 1.0}},
                                {.rays = 64'000, .seed = 5}, materials);

    const auto json = nlohmann::json::parse(csv.out);
    CHECK(json["rays"] == 64'000);
    CHECK(json["segments"] == expected.segments);
    CHECK(json["absorbed"] == expected.absorbed);
    CHECK(json["escaped"] == expected.escaped);
    CHECK(json["leaked"] == 0);
    CHECK(json["escaped_fraction"].get<double>() == Approx(static_cast<double>(expected.escaped) / 64'000.0));
    CHECK(json["relative_error"].get<double>() == expected.relative_error);
    CHECK(json["rays_per_second"].get<double>() > 0.0);
    CHECK(json["segments_per_second"].get<double>() > 0.0);
    CHECK(json["seconds"]["bvh"].get<double>() > 0.0);
    CHECK(json["seconds"]["trace"].get<double>() > 0.0);
    const Mean mean = mean_flux(mesh, expected, [](std::size_t) { return true; });
    CHECK(json["flux"]["mean"].get<double>() == Approx(mean.flux));
    CHECK(json["flux"]["min"].get<double>() < mean.flux);
    CHECK(json["flux"]["max"].get<double>() > mean.flux);

    std::istringstream rows(slurp(shop.folder / "flux.csv"));
    std::string line;
    std::getline(rows, line);
    CHECK(line == "triangle,x,y,z,area,flux,flux_error");
    const Vec3 c = triangle_centroid(mesh, 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        REQUIRE(std::getline(rows, line));
        std::istringstream in(line);
        std::vector<double> fields;
        for (std::string field; std::getline(in, field, ',');) fields.push_back(std::stod(field));
        REQUIRE(fields.size() == 7);
        CHECK(fields[0] == static_cast<double>(t));
        if (t == 0) CHECK(Vec3(fields[1], fields[2], fields[3]).isApprox(c, 1e-8));
        CHECK(fields[4] == Approx(triangle_area(mesh, t)).epsilon(1e-8));
        CHECK(fields[5] == Approx(expected.triangle.flux[t]).epsilon(1e-8));
        CHECK(fields[6] == Approx(expected.triangle.error[t]).epsilon(1e-8));
    }
    CHECK_FALSE(std::getline(rows, line));

    // The VTP run had one thread and must have the same bits.
    const auto file = surface::read_mesh(shop.folder / "flux.vtp");
    CHECK(file.triangle_attribute("flux")->values == expected.triangle.flux);
    CHECK(file.triangle_attribute("flux_error")->values == expected.triangle.error);
    CHECK(file.vertex_attribute("flux")->values == expected.vertex.flux);
    CHECK(file.triangle_attribute("area") != nullptr);
    CHECK(file.triangle_attribute("material") != nullptr);
    CHECK(nlohmann::json::parse(slurp(shop.folder / "flux.json"))["segments"] == expected.segments);
}

TEST_CASE("the flux command's particles collide in a gas as the library's do", "[foreign]") {
    const Workshop shop;
    const auto mesh = two_materials();
    shop.write("trench.vtp", mesh);
    const std::string options =
        "trench.vtp --rays 6400 --sticking 0.2 --boundary reflective --seed 5 --json - ";
    const auto traced = shop.run(options + "--mean-free-path 0.3 -o flux.vtp --method auto");
    CAPTURE(traced.error);
    REQUIRE(traced.code == 0);
    CHECK_THAT(traced.error, Contains("monte-carlo is taken: its particles collide in the gas"));
    Species gas{"test", 1.0, {0.2}};
    gas.mean_free_path = 0.3;
    const auto expected = trace(mesh, kReflective, gas, {.rays = 6400, .seed = 5});
    const auto json = nlohmann::json::parse(traced.out);
    CHECK(json["mean_free_path"] == 0.3);
    CHECK(json["segments"] == expected.segments);
    CHECK(surface::read_mesh(shop.folder / "flux.vtp").triangle_attribute("flux")->values ==
          expected.triangle.flux);
    const auto straight = nlohmann::json::parse(shop.run(options).out);
    CHECK_FALSE(straight.contains("mean_free_path"));
    CHECK(straight["segments"] < json["segments"]);
}

TEST_CASE("a surface that does not end on a rectangle is traced with open sides, and the user is told",
          "[foreign]") {
    const Workshop shop;
    auto mesh = height_field(4, 4, 1.0, 1.0, [](auto, auto) { return 0.0; });
    mesh.triangles.erase(mesh.triangles.begin() + 10);
    shop.write("hole.ply", mesh);
    const auto outcome = shop.run("hole.ply --rays 1000 --json -");
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.error, Contains("open") && Contains("hole"));
    CHECK(nlohmann::json::parse(outcome.out)["boundary"] == nlohmann::json{"open", "open"});
}

TEST_CASE("a mesh some or all of whose triangles are turned over is mended, and the user is told",
          "[foreign]") {
    const Workshop shop;
    const auto mesh = two_materials();
    auto twisted = mesh, inverted = mesh;
    std::swap(twisted.triangles[9][1], twisted.triangles[9][2]);
    for (Triangle& t : inverted.triangles) std::swap(t[1], t[2]);
    shop.write("mesh.vtp", mesh);
    shop.write("twisted.vtp", twisted);
    shop.write("inverted.vtp", inverted);
    const std::string options = " --rays 3200 --boundary periodic --json -";
    const auto expected = shop.run("mesh.vtp" + options);
    CHECK(expected.error.empty());
    for (const auto& [name, note] :
         {std::pair("twisted.vtp", "1 of 64 triangles were turned over"),
          std::pair("inverted.vtp", "inside out: all 64 triangles were turned over")}) {
        const auto outcome = shop.run(name + options);
        CHECK(outcome.code == 0);
        CHECK_THAT(outcome.error, Contains(note));
        CHECK(nlohmann::json::parse(outcome.out)["segments"] ==
              nlohmann::json::parse(expected.out)["segments"]);
    }
}

TEST_CASE("a surface whose outline is no rectangle is traced with open sides, and the user is told why",
          "[foreign]") {
    const Workshop shop;
    shop.write("disk.ply", disk(32));
    const auto outcome = shop.run("disk.ply --rays 3200 --json -");
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.error,
               Contains("taken as open") && Contains("not on a side of its bounding rectangle"));
}

TEST_CASE("Ctrl-C ends a trace within a second, with code 130, and nothing is written", "[foreign][slow]") {
    const Workshop shop;
    shop.write("deep.vtp", extrude(trench_profile(20.0, 0.1, {0.5}, {0.5}), 1.0, 4));
    // --foreground: else timeout signals twice, directly and by the group, and a second Ctrl-C kills.
    const std::string program = "timeout --foreground --preserve-status --signal=INT 1 '" SIDEWALL_PROGRAM
                                "' flux deep.vtp --method monte-carlo ";
    const auto [options, what] = GENERATE(
        table<std::string, std::string>({{"--rays 1e12", "many rays"},
                                         {"--rays 1e12 --sticking 0.00001", "long histories"},
                                         {"--relative-error 1e-6 --rays 1e12 --threads 1", "a far target"}}));
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(("cd '" + shop.folder.string() + "' && " + program + options +
                                    " -o flux.csv --json flux.json > out.txt 2> error.txt")
                                       .c_str());
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    CAPTURE(what, seconds, slurp(shop.folder / "error.txt"));
    CHECK(WEXITSTATUS(status) == 130);
    CHECK(seconds >= 1.0);
    CHECK(seconds < 2.0);
    CHECK_THAT(slurp(shop.folder / "error.txt"), Contains("interrupted"));
    CHECK(slurp(shop.folder / "out.txt").empty());
    CHECK_FALSE(std::filesystem::exists(shop.folder / "flux.csv"));
    CHECK_FALSE(std::filesystem::exists(shop.folder / "flux.json"));
}

TEST_CASE("bad meshes and options of the flux command end with their code and a message, and write nothing",
          "[foreign][slow]") {
    const Workshop shop;
    shop.write("trench.vtp", two_materials());
    auto torn = two_materials();
    torn.triangles.erase(torn.triangles.begin() + 20);
    torn.triangle_attributes.clear();
    shop.write("torn.ply", torn);
    shop.write("disk.ply", disk(32));
    shop.write("lozenge.ply", disk(4));
    auto fractional = two_materials();
    fractional.triangle_attributes[0].type = Scalar::float64;
    fractional.triangle_attributes[0].values[3] = 1.5;
    shop.write("fractional.vtp", fractional);
    std::ofstream(shop.folder / "text.vtp") << "not a mesh\n";
    std::filesystem::create_directory(shop.folder / "folder.vtp");

    const auto [arguments, code, message] = GENERATE(table<std::string, int, std::string>({
        {"", 2, "mesh is required"},
        {"missing.vtp", 3, "missing.vtp"},
        {"text.vtp", 3, "text.vtp"},
        {"disk.ply --boundary reflective", 3, "not on a side of its bounding rectangle"},
        {"disk.ply --boundary periodic", 3, "not on a side of its bounding rectangle"},
        {"disk.ply --boundary open,periodic", 3, "not on a side of its bounding rectangle"},
        {"lozenge.ply --boundary reflective", 3, "not on a side of its bounding rectangle"},
        {"fractional.vtp", 3, "triangle 3 has material 1.5"},
        {"torn.ply --boundary reflective", 3, "not on a side"},
        {"torn.ply --boundary periodic", 3, "not on a side"},
        {"trench.vtp --rays 0", 2, "--rays 0"},
        {"trench.vtp --rays -5", 2, "--rays -5"},
        {"trench.vtp --rays 1.5", 2, "--rays 1.5"},
        {"trench.vtp --rays nan", 2, "--rays nan"},
        {"trench.vtp --rays many", 2, "many"},
        {"trench.vtp --relative-error 0", 2, "--relative-error 0"},
        {"trench.vtp --relative-error nan", 2, "--relative-error nan"},
        {"trench.vtp --source-exponent -1", 2, "source_exponent = -1"},
        {"trench.vtp --source-exponent nan", 2, "source_exponent = nan"},
        {"trench.vtp --sticking 1.4", 2, "must be in [0, 1]"},
        {"trench.vtp --sticking -0.1", 2, "must be in [0, 1]"},
        {"trench.vtp --sticking nan", 2, "must be in [0, 1]"},
        {"trench.vtp --sticking much", 2, "not a number"},
        {"trench.vtp --sticking 2=0.1", 2, "material 7 of trench.vtp is missing"},
        {"trench.vtp --sticking 2=0.1,3=0.1,7=1", 2, "no material 3; it has 2, 7"},
        {"trench.vtp --sticking 2=0.1,2=0.2,7=1", 2, "given twice"},
        {"trench.vtp --sticking 2=0.1,7", 2, "write ID=s"},
        {"trench.vtp --sticking =1", 2, "not a number"},
        {"trench.vtp --mean-free-path 0", 2, "collide too often"},
        {"trench.vtp --mean-free-path nan", 2, "collide too often"},
        {"trench.vtp --mean-free-path 1 --method radiosity", 2, "use --method monte-carlo"},
        {"trench.vtp --boundary mirror", 2, "reflective, periodic or open"},
        {"trench.vtp --boundary open,", 2, "reflective, periodic or open"},
        {"trench.vtp --boundary open,open,open", 2, "reflective, periodic or open"},
        {"trench.vtp --seed -4", 2, "--seed"},
        {"trench.vtp --seed 1e3", 2, "--seed"},
        {"trench.vtp -o result.stl", 2, ".vtp or .csv"},
        {"trench.vtp -o folder.vtp", 5, "folder.vtp: is a folder"},
        {"trench.vtp -o result.csv --json folder.vtp", 5, "folder.vtp: is a folder"},
        {"trench.vtp -o same.csv --json same.csv", 2, "--json same.csv: is the output file, too"},
        {"trench.vtp --rays 1000 -o /proc/sidewall/result.csv", 5, "/proc/sidewall"},
        {"trench.vtp --rays 1000 --json /proc/sidewall/result.json", 5, "/proc/sidewall"},
        {"trench.vtp --threads 0", 2, "threads"},
        {"trench.vtp --frobnicate", 2, "frobnicate"},
    }));
    const bool names_output = arguments.find("-o ") != std::string::npos || arguments.empty();
    const auto outcome = shop.run(arguments + (names_output ? "" : " -o result.csv"));
    CAPTURE(arguments, outcome.error);
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.error, Contains(message));
    CHECK(outcome.out.empty());
    // A result remains only where nothing but the summary, written after it, fails.
    CHECK(std::filesystem::exists(shop.folder / "result.csv") ==
          (arguments.find("--json /proc") != std::string::npos));
}

TEST_CASE("the flux command solves by radiosity what the library solves", "[foreign]") {
    const Workshop shop;
    const auto mesh = two_materials();
    shop.write("trench.vtp", mesh);
    const std::string options = "trench.vtp --sticking 2=0.01,7=1 --seed 5 --boundary reflective ";
    const auto solved = shop.run(options + "--method radiosity --rays 5000 --json - -o flux.vtp");
    CAPTURE(solved.error);
    REQUIRE(solved.code == 0);
    const auto json = nlohmann::json::parse(solved.out);

    std::vector<std::int32_t> materials;  // 0: trench, 1: ledge
    for (const double id : mesh.triangle_attribute("material")->values) materials.push_back(id == 7 ? 1 : 0);
    const LateralBox box = lateral_box(mesh, kReflective);
    const surface::RayScene scene(mesh);
    const Wedges wedges = make_wedges(mesh, materials);
    Exchange exchange(mesh, scene, box, wedges, {1.0}, {.seed = 5});
    const std::vector<double> sticking = sticking_by_wedge(wedges, materials, {.sticking = {0.01, 1.0}});
    const DiffuseSpecies species{.sticking = sticking};
    gather_for({&species, 1}, exchange, 5000);
    const RadiosityFlux expected = solve_flux(exchange, species);
    CHECK(json["method"] == "radiosity");
    CHECK(json["rays"] == exchange.rays());
    CHECK(json["segments"] == exchange.segments());
    CHECK(json["unknowns"] == wedges.count());
    CHECK(json["nonzeros"] == exchange.samples());
    CHECK(json["iterations"] == expected.iterations);
    CHECK(json["relative_error"].get<double>() == expected.relative_error);
    CHECK(json["escaped_fraction"].get<double>() == expected.escaped);
    CHECK(json["seconds"]["solve"].get<double>() > 0.0);
    CHECK(json["seconds"]["trace"].get<double>() > 0.0);
    CHECK(surface::read_mesh(shop.folder / "flux.vtp").triangle_attribute("flux")->values ==
          expected.triangle.flux);

    const auto automatic = shop.run(options + "--method auto --relative-error 0.05 --json -");
    CHECK(automatic.code == 0);
    CHECK_THAT(automatic.error, Contains("is taken: to a relative error of 0.05"));
    CHECK(nlohmann::json::parse(automatic.out)["relative_error"].get<double>() <= 0.05);
    const auto few = shop.run(options + "--method auto --relative-error 1e-4 --rays 200 --json few.json");
    CHECK(few.code == 4);
    CHECK(nlohmann::json::parse(slurp(shop.folder / "few.json"))["rays"] < 400);
    CHECK(nlohmann::json::parse(shop.run(options + "--json - --rays 3200").out)["method"] == "monte-carlo");
    CHECK(shop.run(options + "--relative-error 0").code == 2);
    CHECK(shop.run(options + "--method guess").code == 2);
    CHECK(shop.run(options + "--method radiosity --relative-error 1e-4 --rays 10000").code == 4);
    const auto large = shop.run(options + "--method radiosity --rays 1e11");
    CHECK(large.code == 2);
    CHECK_THAT(large.error, Contains("GB allowed"));
}

TEST_CASE("a target error out of reach ends with code 4 and says so, and what was traced is kept",
          "[foreign]") {
    const Workshop shop;
    shop.write("trench.vtp", two_materials());
    const auto outcome =
        shop.run("trench.vtp --relative-error 1e-4 --rays 10000 -o result.csv --json result.json");
    CHECK(outcome.code == 4);
    CHECK_THAT(outcome.error, Contains("above the 0.0001 asked for") && Contains("allow more rays"));
    CHECK(nlohmann::json::parse(slurp(shop.folder / "result.json"))["relative_error"] > 1e-4);
    CHECK_THAT(slurp(shop.folder / "result.csv"), Contains("triangle,x,y,z,area,flux,flux_error"));
}

TEST_CASE("vertices without triangle and triangles listed again do not change the flux", "[foreign]") {
    const Workshop shop;
    const auto mesh = two_materials();
    auto untidy = mesh;
    untidy.vertices.insert(untidy.vertices.begin(), Vec3(50.0, -3.0, 90.0));
    for (Triangle& t : untidy.triangles)
        for (std::uint32_t& v : t) ++v;
    auto& [a, b, c] = untidy.triangles[9];
    untidy.triangles.push_back({a, c, b});
    untidy.triangle_attributes[0].values.push_back(2.0);
    shop.write("mesh.vtp", mesh);
    shop.write("untidy.vtp", untidy);
    const std::string options = " --rays 3200 --boundary reflective --sticking 2=0.1,7=1 --json -";
    const auto expected = shop.run("mesh.vtp" + options), outcome = shop.run("untidy.vtp" + options);
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.error, Contains("1 vertices that no triangle uses were dropped") &&
                                  Contains("1 triangles that are listed again were dropped"));
    CHECK(nlohmann::json::parse(outcome.out)["segments"] == nlohmann::json::parse(expected.out)["segments"]);
}

TEST_CASE("what flies past the rim of a round plate has escaped, and through a hole it has leaked",
          "[foreign]") {
    const Workshop shop;
    TriangleMesh plate = disk(32);  // with a pit of half its radius
    for (std::uint32_t k = 1; k <= 32; ++k) plate.vertices.push_back(0.5 * plate.vertices[k]);
    plate.vertices[0].z() = -2.0;
    plate.triangles.clear();
    for (std::uint32_t k = 0; k < 32; ++k) {
        const std::uint32_t next = (k + 1) % 32, out = 1 + k, out2 = 1 + next, in = 33 + k, in2 = 33 + next;
        plate.triangles.push_back({0, in, in2});
        plate.triangles.push_back({in, out, out2});
        plate.triangles.push_back({in, out2, in2});
    }
    shop.write("plate.ply", plate);
    const auto outcome = shop.run("plate.ply --rays 100000 --json -");
    CHECK(outcome.code == 0);
    const auto json = nlohmann::json::parse(outcome.out);
    CHECK(json["leaked"] == 0);
    CHECK(json["escaped"] > 20000);  // 1 - pi / 4 of the source lies beside the disk
    plate.triangles.erase(plate.triangles.begin() + 15);
    shop.write("holed.ply", plate);
    const auto leaky = shop.run("holed.ply --rays 100000 --json -");
    CHECK(leaky.code == 4);
    CHECK_THAT(leaky.error, Contains("went through the surface"));
}
