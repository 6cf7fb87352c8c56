#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/integration/run_program.hpp"

// Lithography in the middle of a flow: resumed, checked, reported, and on the wafer of another run.
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

const std::string kWafer = R"([domain]
extent = [2.0, 1.6]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
[[layer]]
material = "SiO2"
thickness = 0.3
[[layer]]
shape = "gap"
subtract = true
z = -0.6
height = 0.4
length = 0.8
)";
const std::string kFirst = R"([[step]]
model = "mask"
material = "Resist"
thickness = 0.4
shape = "hole"
radius = 0.4
[[step]]
model = "directional"
duration = 0.6
directional = { SiO2 = -1.0 }
)";
const std::string kRest = R"([[step]]
model = "strip"
material = "Resist"
[[step]]
model = "mask"
material = "Resist"
thickness = 0.3
conformal = true
polygons = [{ points = [-0.3, -0.3, 0.3, -0.3, 0.3, 0.3, -0.3, 0.3] }]
[[step]]
model = "cut"
materials = ["Si"]
depth = 0.3
shape = "box"
size = [0.6, 0.6]
[[step]]
model = "isotropic"
duration = 0.2
rate = { Si = -0.5 }
)";
const std::string kEnd = "[simplify]\nmethod = \"none\"\n[output]\nprofiles = [\"y=0\"]\n";

// Bytes of the surfaces and tables that a run saved, by name, without the timeline.
std::map<std::string, std::string> surfaces_of_flow(const fs::path& folder) {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension == ".vtp" || extension == ".csv")
            bytes[entry.path().filename().string()] = read_bytes(entry.path());
    }
    bytes.erase("timeline.csv");
    return bytes;
}

}  // namespace

TEST_CASE("a flow that goes on after its first mask ends in the bits of one that was never stopped") {
    const Folder folder;
    write_bytes(folder.path / "first.toml", kWafer + kFirst + kEnd);
    write_bytes(folder.path / "all.toml", kWafer + kFirst + kRest + kEnd);
    for (const char* run :
         {"run first.toml -o parts", "run all.toml -o parts --resume", "run all.toml -o whole"}) {
        const Outcome outcome = run_program(folder.path, run);
        INFO(run << "\n" << outcome.output);
        REQUIRE(outcome.exit_code == 0);
    }
    const auto parts = surfaces_of_flow(folder.path / "parts"),
               whole = surfaces_of_flow(folder.path / "whole");
    REQUIRE(whole.size() > 4);
    for (const auto& [name, bytes] : whole) {
        INFO(name);
        REQUIRE(parts.contains(name));
        CHECK(parts.at(name) == bytes);
    }
    const auto summary = nlohmann::json::parse(read_bytes(folder.path / "whole" / "summary.json"));
    REQUIRE(summary["vanished"].size() == 1);  // the first mask, before the second one came
    CHECK(summary["vanished"][0]["material"] == "Resist");
    CHECK(summary["steps"].size() == 6);
}

TEST_CASE("masks and cuts work on the wafer of another run, and check looks at them") {
    const Folder folder;
    write_bytes(folder.path / "first.toml", kWafer + kFirst + kEnd);
    write_bytes(folder.path / "rest.toml",
                kWafer.substr(0, kWafer.find("[[layer]]")) + "[start]\nfrom = \"a\"\n" + kRest + kEnd);
    write_bytes(
        folder.path / "deep.toml",
        kWafer.substr(0, kWafer.find("[[layer]]")) +
            "[start]\nfrom = \"a\"\n[[step]]\nmodel = \"cut\"\nmaterials = [\"Si\"]\nshape = \"hole\"\nradius = 0.5\n");
    REQUIRE(run_program(folder.path, "run first.toml -o a").exit_code == 0);
    const Outcome check = run_program(folder.path, "check rest.toml");
    INFO(check.output);
    CHECK(check.exit_code == 0);
    CHECK(check.output.find("model = \"mask\"") != std::string::npos);
    CHECK(check.output.find("openings = true") != std::string::npos);
    CHECK(run_program(folder.path, "run rest.toml -o b").exit_code == 0);
    // A fault that shows only with the other run's substrate.
    const Outcome deep = run_program(folder.path, "run deep.toml -o c");
    INFO(deep.output);
    CHECK(deep.exit_code == 3);
    CHECK(deep.output.find("must end at a depth") != std::string::npos);
}

TEST_CASE("the keys of masks and cuts are listed for all their shapes") {
    const Folder folder;
    const std::string keys =
        run_program(folder.path, "models mask").output + run_program(folder.path, "models cut").output;
    for (const char* key :
         {"conformal", "polygons[].points", "gds_layer", "openings", "radius", "width", "size", "depth"})
        CHECK(keys.find(key) != std::string::npos);
    const std::string shapes = run_program(folder.path, "models layer").output;
    for (const char* shape : {"sphere", "cylinder", "gap", "profile"})
        CHECK(shapes.find("shape = \"" + std::string(shape) + "\"") != std::string::npos);
}
