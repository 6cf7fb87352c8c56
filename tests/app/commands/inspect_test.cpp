#include <CLI/CLI.hpp>
#include <catch2/catch.hpp>

#include "app/results/result.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/app/report/result_folder.hpp"

namespace sidewall::app {
void add_inspect_command(CLI::App& program);  // app/commands/inspect.cpp
}

using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

Json inspect(const std::string& input, const std::filesystem::path& scratch) {
    CLI::App program;
    add_inspect_command(program);
    program.parse("inspect " + input + " --json " + (scratch / "out.json").string());
    return Json::parse(surface::read_whole_file(scratch / "out.json"));
}

}  // namespace

TEST_CASE("inspecting a folder finds its last surface, the interfaces of that time and the summary",
          "[foreign]") {
    const test::Folder folder;
    test::write_result_folder(folder.path);
    const Result result = read_result(folder.path);
    CHECK(result.source.filename() == "surface_0001.vtp");
    CHECK(result.interfaces.size() == 1);
    const Json json = inspect(folder.path.string(), folder.path);
    CHECK(json["interfaces"] == 1);
    CHECK(json["metadata"]["length_unit"] == "um");
    CHECK(json["summary"]["metrology"]["depth"] == 1.0);
    const Json& surface = json["surface"];
    CHECK(surface["vertices"] == 6 * 9);
    CHECK(surface["triangles"] == 2 * 5 * 8);
    // Flats 2 x 1.4, floor 2 x 0.6, two walls of 2 x 1.
    CHECK(surface["area"].get<double>() == Approx(2.8 + 1.2 + 4.0).epsilon(1e-13));
    CHECK(surface["box"]["min"] == Json::array({-1.0, -1.0, -0.8}));
    CHECK(surface["topology"]["euler"] == 1);
    CHECK(surface["topology"]["boundary_on_rectangle"] == true);
    CHECK(surface["topology"]["manifold"] == true);
    CHECK(surface["attributes"].size() == 3);
    CHECK(surface["attributes"][1]["name"] == "flux_neutral");
    CHECK(surface["attributes"][1]["max"].get<double>() == Approx(1.2));
}

TEST_CASE("attributes that are not finite are counted and make no bad JSON", "[foreign]") {
    const test::Folder folder;
    TriangleMesh mesh = test::trench_surface();
    mesh.vertex_attributes.push_back(
        {"odd", 1, Scalar::float64, std::vector<double>(mesh.vertices.size(), std::nan(""))});
    surface::write_mesh(folder.path / "odd.vtp", mesh);
    const Json json = inspect((folder.path / "odd.vtp").string(), folder.path);
    CHECK(json["surface"]["attributes"][0]["min"].is_null());
    CHECK(json["surface"]["attributes"][0]["not_finite"] == mesh.vertices.size());
}

TEST_CASE("a folder that is no result, or a damaged one, is refused by name", "[foreign]") {
    const test::Folder folder;
    const auto write = [&](const char* name, const char* text) { std::ofstream(folder.path / name) << text; };
    CHECK_THROWS_WITH(read_result(folder.path / "none"), Contains("none: no such file or folder"));
    CHECK_THROWS_WITH(read_result(folder.path), Contains("has no surface.pvd"));
    write("surface.pvd", "");
    CHECK_THROWS_WITH(read_result(folder.path), Contains("lists no surface"));
    write("surface.pvd", "<DataSet timestep=\"1\"/>");
    CHECK_THROWS_WITH(read_result(folder.path), Contains("names no file"));
    write("surface.pvd", "<DataSet timestep=\"1\" file=\"interface_0.vtp\"/>");
    CHECK_THROWS_WITH(read_result(folder.path), Contains("no file named surface_*"));
    write("surface.pvd", "<DataSet timestep=\"x\" file=\"surface_gone.vtp\"");
    CHECK_THROWS_WITH(read_result(folder.path), Contains("surface_gone.vtp") && Contains("no such file"));
    test::write_result_folder(folder.path);
    write("summary.json", "{ \"version\": ");
    CHECK_THROWS_WITH(read_result(folder.path), Contains("summary.json") && Contains("is no JSON"));
    // Any valid JSON is accepted.
    write("summary.json", "[1, {\"timing\": null}]");
    CHECK_NOTHROW(inspect(folder.path.string(), folder.path));
    write("summary.json", "{\"steps\": 3, \"timing\": {\"total\": null}, \"mesh\": [], \"metrology\": null}");
    CHECK_NOTHROW(inspect(folder.path.string(), folder.path));
}

TEST_CASE("a file's own names and colours of materials come before the built-in ones", "[foreign]") {
    const surface::MeshMetadata metadata{
        {{"materials", "Si,Unobtainium,W"}, {"material_colours", ",#102030"}}, {}};
    const Materials materials = materials_of(metadata);
    REQUIRE(materials.size() == 3);
    CHECK(materials[0].colour == default_materials()[0].colour);
    CHECK(materials[1].name == "Unobtainium");
    CHECK(materials[1].colour == "#102030");
    CHECK(materials[2].density ==
          default_materials()[std::size_t(*material_id(default_materials(), "W"))].density);
    CHECK(materials_of({}) == default_materials());
    using namespace std::string_literals;
    const Materials listed = materials_of(
        {{{"materials", "Si\0In0.5,Ga0.5As\0a\x1b[2J\nb"s}, {"material_colours", "\0#102030\0"s}}, {}});
    REQUIRE(listed.size() == 3);
    CHECK(listed[1].name == "In0.5,Ga0.5As");
    CHECK(listed[1].colour == "#102030");
    CHECK(listed[2].name == "a\\x1b[2J\\x0ab");
}
