#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "surface/files/mesh_io.hpp"
#include "tests/folder.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/surface/surface_meshes.hpp"

// Meshes of other programs as input of the commands.
using namespace sidewall;
using namespace sidewall::test;
using Catch::Matchers::Contains;

namespace {

// A recipe with these layers, which name a mesh file, one step and one measure.
std::string recipe(const std::string& layers, const std::string& step, const std::string& measure) {
    return "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\nboundary = \"reflective\"\n" + layers +
           "[[step]]\n" + step + "[metrology]\nmeasures = [\"" + measure + "\"]\n";
}

const std::string kMesh = "[[layer]]\nmaterial = \"SiO2\"\nshape = \"mesh\"\nfile = \"w.obj\"\n",
                  kOnSilicon = "[[layer]]\nmaterial = \"Si\"\n" + kMesh,
                  kNothing = "model = \"isotropic\"\nduration = 1e-6\nrate = { SiO2 = -1e-6 }\n";

// A block from \p x - 0.75 to \p x + 0.75 in x and in y, and from -0.5 to 1; its corners are counted from \p
// first.
std::string block(double x, int first) {
    std::string text;
    for (int k = 0; k < 8; ++k)
        text += "v " + std::to_string(x + ((k & 1) != 0 ? 0.75 : -0.75)) + " " +
                std::to_string(x + ((k & 2) != 0 ? 0.75 : -0.75)) + ((k & 4) != 0 ? " 1\n" : " -0.5\n");
    const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& face : faces) {
        text += "f";
        for (const int corner : face) text += " " + std::to_string(first + corner);
        text += "\n";
    }
    return text;
}

struct MeshWafer {
    double figure = 0.0;
    Outcome outcome;
};

MeshWafer run_wafer(const std::string& mesh, const std::string& text, const std::string& figure) {
    const Folder folder;
    std::ofstream(folder.path / "w.obj") << mesh;
    std::ofstream(folder.path / "r.toml") << text;
    MeshWafer wafer{.outcome = run_program(folder.path, "run r.toml -o out --quiet")};
    INFO(wafer.outcome.output);
    REQUIRE(wafer.outcome.exit_code == 0);
    std::ifstream in(folder.path / "out" / "summary.json");
    wafer.figure = nlohmann::json::parse(in)["metrology"][figure].get<double>();
    return wafer;
}

}  // namespace

TEST_CASE("a wafer whose mesh is listed inside out etches as the right one, and the user is told",
          "[foreign]") {
    const std::string corners = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\n";
    const std::string text = recipe(kMesh, "model = \"isotropic\"\nduration = 0.5\nrate = -1.0\n", "depth");
    const MeshWafer right = run_wafer(corners + "f 1 2 3 4\n", text, "depth"),
                    turned = run_wafer(corners + "f 4 3 2 1\n", text, "depth"),
                    mixed = run_wafer(corners + "f 1 2 3\nf 1 4 3\n", text, "depth");
    CHECK(right.figure == Approx(0.5).margin(1e-3));
    CHECK(turned.figure == right.figure);
    CHECK(mixed.figure == right.figure);
    CHECK(right.outcome.output.find("note") == std::string::npos);
    CHECK_THAT(turned.outcome.output, Contains("r.toml: note: layer[0].file: the surface was inside out"));
    CHECK_THAT(mixed.outcome.output, Contains("layer[0].file: 1 of 2 triangles were turned over"));
}

TEST_CASE("overlapping bodies have the volume of their union, those with an opening that of the whole",
          "[foreign]") {
    // The grid cuts edges off by parts of a cell's area: 0.005 um^2 along the 12 um of two blocks' at most.
    const auto volume = [](const std::string& mesh) {
        return run_wafer(mesh, recipe(kOnSilicon, kNothing, "volume_SiO2"), "volume_SiO2").figure;
    };
    const std::string first = block(-0.263, 1), second = block(0.237, 9);
    CHECK(volume(first) == Approx(2.25).epsilon(0.01));
    CHECK(volume(first + second) == Approx(2.25 + 2.25 - 1.0).epsilon(0.01));
    CHECK(volume(block(0.237, 1) + block(-0.263, 9)) == Approx(3.5).epsilon(0.01));
    // The block without its last face, x = 0.487: the opening is a fifth of the remaining area.
    CHECK(volume(first.substr(0, first.rfind("f "))) == Approx(volume(first)).epsilon(1e-6));
}

TEST_CASE(
    "a body over the corner of a periodic box has the volumes of one in its middle, and the user is told",
    "[foreign]") {
    std::string text =
        recipe(kOnSilicon, "model = \"conformal\"\nthickness = 0.2\nmaterial = \"Si3N4\"\n", "volume_SiO2");
    text.replace(text.find("reflective"), 10, "periodic");
    for (const char* figure : {"volume_SiO2", "added_volume_Si3N4"}) {
        const MeshWafer middle = run_wafer(block(0.2, 1), text, figure),
                        corner = run_wafer(block(2.2, 1), text, figure);
        CHECK(corner.figure == Approx(middle.figure).epsilon(1e-6));
        CHECK(middle.outcome.output.find("note") == std::string::npos);
        CHECK_THAT(corner.outcome.output, Contains("layer[1].file: 1 of its bodies cross periodic sides"));
    }
}

TEST_CASE("a body of loose faces whose corners rounding put apart is the whole one, and the user is told",
          "[foreign]") {
    const auto loose = [](double noise) {
        std::istringstream lines(block(-0.263, 1));
        std::vector<std::array<double, 3>> corners(9);
        std::string mesh, word;
        for (int count = 0; lines >> word;)
            for (int k = 0; k < (word == "v" ? 3 : 4); ++k) {
                if (word == "v") {
                    if (k == 0) ++count;
                    lines >> corners[static_cast<std::size_t>(count)][static_cast<std::size_t>(k)];
                    continue;
                }
                std::size_t corner = 0;
                lines >> corner;
                mesh += "v";
                for (const double x : corners[corner])
                    mesh += fmt::format(" {}", x + noise * (count++ % 5 - 2));
                mesh += "\n" + std::string(k == 3 ? "f -4 -3 -2 -1\n" : "");
            }
        return run_wafer(mesh, recipe(kOnSilicon, kNothing, "volume_SiO2"), "volume_SiO2");
    };
    const MeshWafer exact = loose(0.0), rounded = loose(2e-7), six_digits = loose(2e-6);
    CHECK(exact.figure == Approx(2.25).epsilon(0.01));
    // Two faces lie on nodes and may be rounded to either side: 1e-3 of a spacing on all 13.5 um^2.
    CHECK(rounded.figure == Approx(exact.figure).margin(1e-3 * 0.1 * 13.5));
    CHECK(six_digits.figure == Approx(exact.figure).margin(1e-3 * 0.1 * 13.5));
    CHECK_THAT(exact.outcome.output, Contains("16 vertices of the same position"));
    CHECK_THAT(rounded.outcome.output,
               Contains("layer[1].file: 16 vertices less than 2.6e-05 from another were merged"));
    CHECK_THAT(six_digits.outcome.output, Contains("16 vertices less than"));
}

TEST_CASE("a mesh that cannot be mended is refused with file, layer and place", "[foreign]") {
    const Folder folder;
    // A Moebius strip of five squares.
    std::ofstream(folder.path / "w.obj")
        << "v 1 0 0\nv 1 0 0.4\nv 0.3 0.9 0\nv 0.3 0.9 0.4\nv -0.8 0.6 0\nv -0.8 0.6 0.4\nv -0.8 -0.6 0\nv -0.8 -0.6 0.4\n"
           "v 0.3 -0.9 0\nv 0.3 -0.9 0.4\nf 1 3 4 2\nf 3 5 6 4\nf 5 7 8 6\nf 7 9 10 8\nf 9 2 1 10\n";
    std::ofstream(folder.path / "r.toml") << recipe(kOnSilicon, kNothing, "depth");
    const Outcome outcome = run_program(folder.path, "check r.toml --no-estimate");
    CHECK(outcome.exit_code == 2);
    CHECK_THAT(outcome.output,
               Contains("r.toml:10: layer[1].file = \"w.obj\": the surface has one side only: around"));
    // An L-shaped body whose caps are fans from a corner that does not see all of them.
    const double x[] = {1.03, 0.03, 0.03, -0.97, -0.97, 1.03}, y[] = {0.03, 0.03, 1.03, 1.03, -0.97, -0.97};
    std::string fans;
    for (const char* z : {"-0.52", "0.98"})
        for (int k = 0; k < 6; ++k) fans += fmt::format("v {} {} {}\n", x[k], y[k], z);
    for (int k = 1; k < 5; ++k) fans += fmt::format("f 1 {} {}\nf 7 {} {}\n", k + 2, k + 1, k + 7, k + 8);
    for (int k = 0; k < 6; ++k)
        fans += fmt::format("f {} {} {} {}\n", k + 1, (k + 1) % 6 + 1, (k + 1) % 6 + 7, k + 7);
    std::ofstream(folder.path / "w.obj") << fans;
    const Outcome folded = run_program(folder.path, "run r.toml -o out --quiet");
    CHECK(folded.exit_code == 3);
    CHECK_THAT(folded.output, Contains("w.obj: the wafer of this mesh has no closed surface"));
}

TEST_CASE("simplify welds triangles with vertices of their own and says so, and inspect tells what is mended",
          "[foreign]") {
    const Folder folder;
    TriangleMesh welded;  // 10 x 10 squares, flat
    for (int i = 0; i <= 10; ++i)
        for (int j = 0; j <= 10; ++j) welded.vertices.emplace_back(i, j, 0.0);
    for (std::uint32_t i = 0; i < 10; ++i)
        for (std::uint32_t j = 0; j < 10; ++j) {
            const std::uint32_t a = 11 * i + j, b = a + 11;
            welded.triangles.push_back({a, b, b + 1});
            welded.triangles.push_back({a, b + 1, a + 1});
        }
    TriangleMesh loose = test::soup(welded);
    std::swap(loose.triangles[7][1], loose.triangles[7][2]);
    surface::write_mesh(folder.path / "welded.vtp", welded);
    surface::write_mesh(folder.path / "loose.vtp", loose);
    const Outcome sound = run_program(folder.path, "simplify welded.vtp -o a.vtp"),
                  mended = run_program(folder.path, "simplify loose.vtp -o b.vtp");
    CHECK(sound.output.find("merged") == std::string::npos);
    CHECK_THAT(mended.output,
               Contains("loose.vtp: 479 vertices of the same position as another were merged with it; "
                        "1 of 200 triangles were turned over"));
    const TriangleMesh a = surface::read_mesh(folder.path / "a.vtp"),
                       b = surface::read_mesh(folder.path / "b.vtp");
    CHECK(a.vertices.size() < welded.vertices.size() / 2);
    CHECK(b.vertices.size() == a.vertices.size());
    CHECK(total_area(b) == Approx(100.0));
    const Outcome shown = run_program(folder.path, "inspect loose.vtp");
    CHECK_THAT(shown.output, Contains("import      479 vertices of the same position"));
    CHECK(run_program(folder.path, "inspect welded.vtp").output.find("import") == std::string::npos);
}

TEST_CASE("a body whose foot lies on the wafer stands on it, whichever way its faces are cut in two",
          "[foreign]") {
    // Faces on nodes, cut along one diagonal or the other.
    const double height = GENERATE(0.6, 0.1);
    const auto cut = [&](std::size_t from) {
        std::string text;
        for (int k = 0; k < 8; ++k)
            text += std::string("v ") + ((k & 1) != 0 ? "0.3" : "-0.3") +
                    ((k & 2) != 0 ? " 0.2 " : " -0.2 ") + ((k & 4) != 0 ? std::to_string(height) : "0") +
                    "\n";
        const int faces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                 {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
        for (const auto& f : faces)
            for (const std::size_t second : {from + 1, from + 2})
                text += "f " + std::to_string(f[from]) + " " + std::to_string(f[second % 4]) + " " +
                        std::to_string(f[(second + 1) % 4]) + "\n";
        return text;
    };
    const std::string etch = "model = \"isotropic\"\nduration = 0.5\nrate = { Si = -0.2 }\n",
                      still = recipe(kOnSilicon, kNothing, "volume_SiO2");
    const double volume = run_wafer(cut(0), still, "volume_SiO2").figure;
    // Marching cubes cuts every edge by half a cell's area at most: as much as the box of the same size.
    const std::string box =
        "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"SiO2\"\nshape = \"box\"\n"
        "size = [0.6, 0.4]\nheight = " +
        std::to_string(height) + "\n";
    const double as_box = run_wafer(cut(0), recipe(box, kNothing, "volume_SiO2"), "volume_SiO2").figure;
    CAPTURE(height, as_box);
    CHECK(volume == Approx(0.24 * height).margin(0.005 * (4.0 + 4.0 * height)));
    CHECK(volume == Approx(as_box).margin(0.005 * 0.4));
    CHECK(run_wafer(cut(1), still, "volume_SiO2").figure == Approx(volume).epsilon(1e-6));
    const std::string etched = recipe(kOnSilicon, etch, "volume_SiO2");
    CHECK(run_wafer(cut(1), etched, "removed_volume_Si").figure ==
          Approx(run_wafer(cut(0), etched, "removed_volume_Si").figure).epsilon(1e-3));
}
