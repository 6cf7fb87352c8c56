#include <zlib.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "app/devices/device.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/app/report/result_folder.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/tet_checks.hpp"

// Results for other programs: tetrahedra and surfaces.
namespace {

using namespace sidewall;
using nlohmann::json;

void run_recipe(const test::Folder& folder, const std::string& recipe) {
    const auto ran = test::run_program(
        folder.path, "run " + test::config("quick/" + recipe + ".toml") + " -o run --quiet", 120);
    INFO(ran.output);
    REQUIRE(ran.exit_code == 0);
}

// Runs commands of the program one after another, which must all succeed.
void run_all(const test::Folder& folder, const std::vector<std::string>& commands) {
    for (const std::string& command : commands) {
        const auto ran = test::run_program(folder.path, command);
        INFO(command << "\n" << ran.output);
        REQUIRE(ran.exit_code == 0);
    }
}

/// The values of an array of a VTU file whose data are appended, compressed by blocks.
template <class T>
std::vector<T> vtu_array(const std::string& file, const std::string& name) {
    const std::string key = "Name=\"" + name + "\"";
    const std::size_t offset_at = file.find("offset=\"", file.find(key)) + 8;
    std::size_t at = file.find("\n   _") + 5 + std::stoull(file.substr(offset_at));
    const auto word = [&] {
        std::uint64_t value = 0;
        std::memcpy(&value, file.data() + at, 8);
        at += 8;
        return value;
    };
    const std::uint64_t blocks = word(), size = word(), rest = word();
    std::vector<std::uint64_t> compressed(blocks);
    for (std::uint64_t& bytes : compressed) bytes = word();
    std::string data;
    for (std::size_t b = 0; b < blocks; ++b) {
        uLongf plain = b + 1 == blocks && rest > 0 ? rest : size;
        std::string block(plain, '\0');
        REQUIRE(uncompress(reinterpret_cast<Bytef*>(block.data()), &plain,
                           reinterpret_cast<const Bytef*>(file.data() + at), compressed[b]) == Z_OK);
        data += block;
        at += compressed[b];
    }
    std::vector<T> values(data.size() / sizeof(T));
    std::memcpy(values.data(), data.data(), data.size());
    return values;
}

void check_device(const app::Device& device, const app::Result& result, bool gas) {
    const TetMesh& mesh = device.mesh;
    Box3 box = bounding_box(result.surface);
    box.min.z() = device.bottom;
    for (const Vec3& p : mesh.vertices) box.max.z() = std::max(box.max.z(), p.z());
    test::check_tets(mesh, box, !gas);
    const TetQuality quality = measure_tets(mesh);
    for (std::size_t r = 0; r < mesh.regions.size(); ++r) {
        CAPTURE(mesh.regions[r]);
        CHECK(std::abs(quality.volume[r] / device.volume[r] - 1.0) < 0.001);  // 0.005 is promised
    }
    // Boundaries are exactly the faces of one tetrahedron and those between regions.
    const auto faces = test::faces_of(mesh);
    std::size_t expected = 0;
    for (const auto& [face, regions] : faces) expected += regions.size() == 1 || regions[0] != regions[1];
    CHECK(mesh.triangles.size() == expected);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        test::Sorted face = mesh.triangles[t];
        std::sort(face.begin(), face.end());
        const auto found =
            std::lower_bound(faces.begin(), faces.end(), face,
                             [](const test::FaceAt& f, const test::Sorted& s) { return f.face < s; });
        REQUIRE((found != faces.end() && found->face == face));
        const auto& regions = found->regions;
        const std::string& name = mesh.boundaries[static_cast<std::size_t>(mesh.boundary[t])];
        const auto region = [&](std::size_t k) { return mesh.regions[static_cast<std::size_t>(regions[k])]; };
        if (name.find('/') != std::string::npos) {
            REQUIRE(regions.size() == 2);
            REQUIRE((name == region(0) + "/" + region(1) || name == region(1) + "/" + region(0)));
        }
        if (name == "x-max")
            for (const std::uint32_t v : face) REQUIRE(mesh.vertices[v].x() == box.max.x());
        if (name == "bottom")
            for (const std::uint32_t v : face) REQUIRE(mesh.vertices[v].z() == device.bottom);
        if (name == "surface") REQUIRE(regions.size() == (gas ? 2u : 1u));
    }
}

/// What VTK reads from a file; null where it is not installed.
json read_by_vtk(const test::Folder& folder, const std::string& file) {
    const std::string python = "/usr/bin/python3 ";
    if (test::run_command(folder.path, python + "-c 'import vtkmodules.vtkIOXML' 2>&1").exit_code != 0) {
        WARN("python3-vtk9 is not installed: VTK's reader is not tried");
        return nullptr;
    }
    const auto read = test::run_command(
        folder.path, python + SIDEWALL_SOURCE_DIR "/tests/integration/vtk_reads.py " + file + " 2>&1");
    INFO(read.output);
    REQUIRE(read.exit_code == 0);
    return json::parse(read.output);
}

void check_result(const std::filesystem::path& folder, double spacing, bool gas) {
    CHECK(app::load_frame(folder / "recipe.toml").domain.grid_spacing == spacing);
    const app::Result result = app::read_result(folder);
    check_device(app::make_device(result, spacing, {.gas = gas}), result, gas);
}

}  // namespace

TEST_CASE("a fin's materials become tetrahedra that share their interfaces", "[slow]") {
    const test::Folder folder;
    run_recipe(folder, "fin_sequence");
    for (const bool gas : {false, true}) check_result(folder.path / "run", 2.0, gas);
}

TEST_CASE("a scalloped hole with a polymer of a fraction of a cell becomes tetrahedra", "[slow]") {
    const test::Folder folder;
    run_recipe(folder, "bosch_hole");
    check_result(folder.path / "run", 0.125, false);
    // At first the polymer has no thickness.
    const auto early = test::run_program(folder.path, "export run -o early.vtu --time 0 --size 0.5 --json -");
    INFO(early.output);
    REQUIRE(early.exit_code == 0);
    const json told = json::parse(early.output);
    CHECK(told["time"] == 0.0);
    CHECK(told["regions"].size() == 2);
    CHECK(told["quality"]["inverted"] == 0);
    CHECK(told["quality"]["min_dihedral_deg"] > 5.0);
}

TEST_CASE("thin films, worn masks and a few cells of polymer keep their volumes as tetrahedra", "[slow]") {
    const auto [recipe, spacing] = GENERATE(
        std::pair("nanowires", 2.0), std::pair("finfet", 2.0), std::pair("fluorocarbon_contact", 10.0),
        std::pair("ion_beam_trench", 0.025), std::pair("oxide_nitride_stack", 5.0));
    const test::Folder folder;
    run_recipe(folder, recipe);
    check_result(folder.path / "run", spacing, false);
}

TEST_CASE("the files of tetrahedra hold what was made, and VTK and Gmsh read their own", "[slow]") {
    const test::Folder folder;
    run_recipe(folder, "fin_sequence");
    for (const char* threads : {"1", "2"}) {
        const auto made = test::run_program(
            folder.path, std::string("export run -o ") + threads + ".vtu --size 8 --threads " + threads);
        INFO(made.output);
        REQUIRE(made.exit_code == 0);
        CHECK(made.output.find("smallest angle") != std::string::npos);
        CHECK(made.output.find("Si/SiO2") != std::string::npos);
    }
    CHECK(test::read_bytes(folder.path / "1.vtu") == test::read_bytes(folder.path / "2.vtu"));
    const app::Result result = app::read_result(folder.path / "run");
    const app::Device device = app::make_device(result, 2.0, {.size = 8.0});
    const TetMesh& mesh = device.mesh;
    const std::string vtu = test::read_bytes(folder.path / "1.vtu");
    const auto points = vtu_array<double>(vtu, "Points");
    REQUIRE(points.size() == 3 * mesh.vertices.size());
    // Equal to rounding: these tests and the program may each have their own compilation of Eigen's solvers.
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        REQUIRE((Vec3(points[3 * v], points[3 * v + 1], points[3 * v + 2]) - mesh.vertices[v])
                    .cwiseAbs()
                    .maxCoeff() < 1e-14);
    const auto types = vtu_array<std::uint8_t>(vtu, "types");
    const auto corners = vtu_array<std::int64_t>(vtu, "connectivity"),
               ends = vtu_array<std::int64_t>(vtu, "offsets");
    const auto region = vtu_array<std::int32_t>(vtu, "region"),
               boundary = vtu_array<std::int32_t>(vtu, "boundary");
    const std::size_t tets = mesh.tetrahedra.size(), cells = tets + mesh.triangles.size();
    for (const std::size_t size : {types.size(), ends.size(), region.size(), boundary.size()})
        REQUIRE(size == cells);
    for (std::size_t c = 0; c < cells; ++c) {
        const bool tet = c < tets;
        const auto begin = static_cast<std::size_t>(c == 0 ? 0 : ends[c - 1]);
        REQUIRE(types[c] == (tet ? 10 : 5));
        REQUIRE(ends[c] == static_cast<std::int64_t>(begin) + (tet ? 4 : 3));
        REQUIRE(region[c] == (tet ? mesh.region[c] : -1));
        REQUIRE(boundary[c] == (tet ? -1 : mesh.boundary[c - tets]));
        for (std::size_t k = 0; k < (tet ? 4u : 3u); ++k)
            REQUIRE(corners[begin + k] == (tet ? mesh.tetrahedra[c][k] : mesh.triangles[c - tets][k]));
    }

    if (const json read = read_by_vtk(folder, "1.vtu"); !read.is_null()) {
        const TetQuality quality = measure_tets(mesh);
        CHECK(read["points"] == mesh.vertices.size());
        CHECK(read["tetrahedra"] == tets);
        CHECK(read["triangles"] == mesh.triangles.size());
        REQUIRE(read["volumes"].size() == mesh.regions.size());
        for (std::size_t r = 0; r < mesh.regions.size(); ++r)
            CHECK(read["volumes"][r].get<double>() == Approx(quality.volume[r]).epsilon(1e-12));
    }

    REQUIRE(test::run_program(folder.path, "export run -o device.msh --size 8").exit_code == 0);
    if (test::run_command(folder.path, "gmsh --version >/dev/null 2>&1").exit_code != 0) {
        WARN("gmsh is not installed: its reader is not tried");
        return;
    }
    const auto gmsh =
        test::run_command(folder.path, "gmsh device.msh -check -0 -format msh41 -o back.msh 2>&1");
    INFO(gmsh.output);
    CHECK(gmsh.exit_code == 0);
    CHECK(gmsh.output.find("Error") == std::string::npos);
    CHECK(gmsh.output.find("Warning") == std::string::npos);
    CHECK(gmsh.output.find(std::to_string(mesh.vertices.size()) + " nodes") != std::string::npos);
    CHECK(gmsh.output.find(std::to_string(cells) + " elements") != std::string::npos);
    const std::string back = test::read_bytes(folder.path / "back.msh");
    for (const auto* names : {&mesh.regions, &mesh.boundaries})
        for (const std::string& name : *names) CHECK(back.find('"' + name + '"') != std::string::npos);
}

TEST_CASE("names of materials with commas, quotes, blanks and letters of any script come through every file",
          "[slow]") {
    const test::Folder folder;
    const std::string names[] = {"In0.5,Ga0.5As", "a/b;c&d,", "n+ \"poly\" [x] = 1e19 > 0",
                                 "\u03b1-Al2O3,<x&y>"};
    std::string recipe = "[domain]\nextent = [1.0, 0.4]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n",
                materials;
    for (const std::string& name : names) {
        materials += "[[material]]\nname = '" + name + "'\ndensity = 4.0\n";
        recipe += "[[layer]]\nmaterial = '" + name + "'\nthickness = 0.4\n";
    }
    recipe += "[[step]]\nname = \"thin, x\"\nmodel = \"isotropic\"\nduration = 0.5\nrate = { '" + names[3] +
              "' = -0.2 }\nstop = 'volume_" + names[2] + " < 0.1'\n[metrology]\nmeasures = ['volume_" +
              names[2] + "']\n";
    test::write_bytes(folder.path / "recipe.toml", materials + recipe);
    run_all(folder, {"run recipe.toml -o o --quiet", "export o -o o.msh", "export o -o o.vtu --json o.json",
                     "report o -o o.html"});
    const json told = json::parse(test::read_bytes(folder.path / "o.json"));
    REQUIRE(told["regions"].size() == 5);
    const app::Result result = app::read_result(folder.path / "o");
    const app::Materials known = app::materials_of(result.metadata);
    const std::string msh = test::read_bytes(folder.path / "o.msh");
    for (std::size_t k = 0; k < 4; ++k) {
        CHECK(told["regions"][k + 1]["name"] == names[k]);
        // 1 um by 0.4 um; the last film has lost 0.1 of its 0.4 um.
        CHECK(told["regions"][k + 1]["volume"].get<double>() == Approx(k < 3 ? 0.16 : 0.12).epsilon(1e-3));
        CHECK(app::material_id(known, names[k]));
        std::string in_msh = names[k];  // MSH files cannot hold double quotes
        std::replace(in_msh.begin(), in_msh.end(), '"', '\'');
        CHECK(msh.find("\"" + in_msh + "\"\n") != std::string::npos);
    }
    const auto timeline = app::read_text_table(folder.path / "o/timeline.csv");
    CHECK(timeline.rows.front()[1] == "1 thin, x");
    REQUIRE(timeline.column("volume_" + names[2]));
    CHECK(timeline.rows.front()[*timeline.column("volume_" + names[2])] == "0.16");
    const std::string html = test::read_bytes(folder.path / "o.html");
    CHECK(html.find("In0.5,Ga0.5As") != std::string::npos);
    CHECK(html.find("O3,<x&y>") == std::string::npos);
    if (const json read = read_by_vtk(folder, "o.vtu"); !read.is_null()) {
        json expected = json::array({"Si"});
        for (const std::string& name : names) expected.push_back(name);
        CHECK(read["regions"] == expected);
        CHECK(read["materials"].size() == app::default_materials().size() + 4);
        for (std::size_t r = 0; r < 5; ++r)
            CHECK(read["names"].dump().find(json::array({r, expected[r]}).dump()) != std::string::npos);
    }
}

TEST_CASE("a profile leaves as triangles whose areas and edges are those of its materials") {
    const test::Folder folder;
    // 2 um wide: 0.4 of oxide on silicon, of which 0.2 is etched.
    test::write_bytes(
        folder.path / "recipe.toml",
        "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\nboundary = \"periodic\"\n[[layer]]\nmaterial = "
        "\"Si\"\n[[layer]]\nmaterial = \"SiO2\"\nthickness = 0.4\n[[step]]\nmodel = \"isotropic\"\n"
        "duration = 0.5\nrate = { SiO2 = -0.4 }\n");
    run_all(folder, {"run recipe.toml -o o --quiet", "export o -o o.msh --triangles",
                     "export o -o o.vtu --triangles --bottom=-0.7 --json o.json"});
    const json told = json::parse(test::read_bytes(folder.path / "o.json"));
    REQUIRE(told["regions"].size() == 2);
    CHECK(told["regions"][0]["area"].get<double>() == Approx(2.0 * 0.7).epsilon(1e-3));
    // Faces on nodes are drawn a thousandth of a cell off them, on either side.
    CHECK(told["regions"][1]["area"].get<double>() == Approx(2.0 * 0.2).margin(2.0 * 2.1e-4));
    std::map<std::string, double> length;
    for (const json& boundary : told["boundaries"]) length[boundary["name"]] = boundary["length"];
    CHECK(length.size() == 5);
    for (const char* across : {"bottom", "Si/SiO2", "surface"})
        CHECK(length[across] == Approx(2.0).epsilon(1e-3));
    for (const char* side : {"x-min", "x-max"}) CHECK(length[side] == Approx(0.9).epsilon(1e-3));
    const std::string vtu = test::read_bytes(folder.path / "o.vtu");
    const auto types = vtu_array<std::uint8_t>(vtu, "types");
    CHECK(static_cast<std::size_t>(std::count(types.begin(), types.end(), 5)) == told["triangles"]);
    for (const double p : vtu_array<double>(vtu, "Points")) CHECK(std::abs(p) <= 1.0);
    CHECK(test::read_bytes(folder.path / "o.msh").find(" \"Si/SiO2\"\n") != std::string::npos);
    test::write_bytes(
        folder.path / "wide.toml",
        "[domain]\nextent = [2.0, 0.4]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[step]]\n"
        "model = \"isotropic\"\nduration = 0.5\nrate = -0.4\n");
    run_all(folder, {"run wide.toml -o w --quiet"});
    const auto wide = test::run_program(folder.path, "export w -o w.msh --triangles");
    CHECK(wide.exit_code == 2);
    CHECK(wide.output.find("--triangles: this wafer is 0.4 wide") != std::string::npos);
}

TEST_CASE("without a size there are no more tetrahedra than asked for, and every material keeps its volume",
          "[slow]") {
    const test::Folder folder;
    test::write_bytes(
        folder.path / "recipe.toml",
        "[domain]\nextent = [2.0, 1.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\n"
        "width = 0.8\ndepth = 0.6\n[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = 0.2\n"
        "deposit = \"SiO2\"\n");
    REQUIRE(test::run_program(folder.path, "run recipe.toml -o run --quiet").exit_code == 0);
    std::size_t last = 1'000'000;
    for (const char* most : {"20000", "6000", "3000"}) {
        const auto made =
            test::run_program(folder.path, std::string("export run -o x.vtu --json - --most ") + most, 60);
        INFO(made.output);
        REQUIRE(made.exit_code == 0);
        const json told = json::parse(made.output);
        const std::size_t count = told["tetrahedra"];
        CAPTURE(most, count);
        CHECK(static_cast<double>(count) < 1.3 * std::stod(most));
        CHECK(count <= last);
        last = count;
        for (const json& region : told["regions"])
            CHECK(region["volume"].get<double>() ==
                  Approx(region["volume_by_surfaces"].get<double>()).epsilon(0.01));
    }
    CHECK(test::run_program(folder.path, "export run -o x.vtu --most 0").exit_code == 2);
}

TEST_CASE("surfaces leave as STL, OBJ, PLY and one multi-block file") {
    const test::Folder folder;
    test::write_result_folder(folder.path / "run");
    const TriangleMesh surface = app::read_result(folder.path / "run").surface;
    for (const char* name : {"x.stl", "x.obj", "x.ply", "x.vtp"}) {
        const auto made = test::run_program(folder.path, std::string("export run -o ") + name);
        INFO(made.output);
        REQUIRE(made.exit_code == 0);
        CHECK(surface::read_mesh(folder.path / name).triangles.size() == surface.triangles.size());
    }
    const auto made = test::run_program(folder.path, "export run -o all.vtm --json -");
    REQUIRE(made.exit_code == 0);
    const json told = json::parse(made.output);
    const std::string vtm = test::read_bytes(folder.path / "all.vtm");
    CHECK(vtm.find("vtkMultiBlockDataSet") != std::string::npos);
    for (std::size_t k = 0; k < told["blocks"].size(); ++k) {
        const std::string file = "all/block_" + std::to_string(k) + ".vtp";
        CHECK(vtm.find("name=\"" + told["blocks"][k]["name"].get<std::string>() + "\" file=\"" + file) !=
              std::string::npos);
        CHECK(surface::read_mesh(folder.path / file).triangles.size() == told["blocks"][k]["triangles"]);
    }
    if (const json read = read_by_vtk(folder, "all.vtm"); !read.is_null()) {
        REQUIRE(read.size() == told["blocks"].size());
        for (std::size_t k = 0; k < read.size(); ++k) CHECK(read[k] == told["blocks"][k]["triangles"]);
    }
}

TEST_CASE("a material called gas leaves without the gas, and with it under another name", "[foreign]") {
    const test::Folder folder;
    const auto exported = [&](const std::string& name, const std::string& arguments) {
        test::write_bytes(
            folder.path / "r.toml",
            "[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\n[[material]]\nname = \"" + name +
                "\"\ndensity = 5.0\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"" + name +
                "\"\nthickness = 0.3\n[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n");
        REQUIRE(test::run_program(folder.path, "run r.toml -o out --overwrite --quiet").exit_code == 0);
        return test::run_program(folder.path, "export out " + arguments);
    };
    const auto refused = exported("gas", "-o x.msh --gas");
    CHECK(refused.exit_code == 2);
    CHECK(refused.output.find("--gas: a material has the name gas") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder.path / "x.msh"));
    CHECK(exported("gas", "-o x.msh").exit_code == 0);
    CHECK(exported("Gas", "-o x.vtu --gas").exit_code == 0);
}

TEST_CASE("what export cannot do is said", "[foreign][slow]") {
    const test::Folder folder;
    test::write_result_folder(folder.path / "run");
    const auto says = [&](const std::string& arguments, int code, const std::string& text) {
        const auto outcome = test::run_program(folder.path, "export " + arguments);
        INFO(arguments << "\n" << outcome.output);
        CHECK(outcome.exit_code == code);
        CHECK(outcome.output.find(text) != std::string::npos);
    };
    says("run -o x.step", 2, "must end in .vtu or .msh");
    says("run -o x.stl --size 1", 2, "--size");
    says("nowhere -o x.vtu", 3, "nowhere");
    says("run -o x.vtu", 3, "recipe.toml");  // the folder is incomplete
    std::ofstream(folder.path / "run/recipe.toml") << "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.1\n";
    says("run -o x.vtu --size 0", 2, "--size 0");
    says("run -o x.vtu --size nan", 2, "--size");
    says("run -o x.vtu --size 1e-6", 2, "tetrahedra and need about");
    says("run -o x.vtu --bottom 5", 2, "--bottom 5");
    says("run -o x.vtu --time 77", 2, "--time 77");
    says("run -o nofolder/../run/surface.pvd/x.vtu", 5, "surface.pvd");
    CHECK_FALSE(std::filesystem::exists(folder.path / "x.vtu"));
    says("run -o x.vtu --bottom=-1e9", 2, "--bottom -1e+09: must lie less than");
    // No file of the run is replaced, nor one output by the other.
    says("run -o run/surface_0001.vtp", 2, "among the run's own files");
    says("run -o run.vtm", 2, "among the run's own files");
    says("run -o x.stl --json run/recipe.toml", 2, "among the run's own files");
    says("run -o x.vtu --json x.vtu", 2, "is the file of -o, too");
    says("run -o X.VTU", 0, "smallest angle");
    const std::string list = test::read_bytes(folder.path / "run/surface.pvd");
    std::ofstream(folder.path / "run/surface.pvd") << list.substr(0, list.size() / 2);
    says("run -o x.vtu", 3, "surface.pvd: ends too early");
}
