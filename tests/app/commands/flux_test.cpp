#include <CLI/CLI.hpp>
#include <catch2/catch.hpp>

#include "surface/files/mesh_io.hpp"
#include "tests/app/report/result_folder.hpp"

namespace sidewall::app {
void add_flux_command(CLI::App& program);  // app/commands/flux.cpp
}

using namespace sidewall;

TEST_CASE("flux keeps what the surface's file says: units, time, names of materials and their ids") {
    const test::Folder folder;
    const TriangleMesh mesh = test::trench_surface();
    surface::MeshMetadata written{{{"length_unit", "nm"}, {"time_unit", "s"}}, {{"time", 2.5}}};
    surface::add_list(written, "materials", {"Si", "SiO2"});
    surface::write_mesh(folder.path / "in.vtp", mesh, written);
    CLI::App program;
    app::add_flux_command(program);
    program.parse("flux " + (folder.path / "in.vtp").string() + " -o " + (folder.path / "out.vtp").string() +
                  " --rays 320 --json " + (folder.path / "out.json").string());
    surface::MeshMetadata read;
    const TriangleMesh traced = surface::read_mesh(folder.path / "out.vtp", &read);
    CHECK(read.texts == written.texts);
    CHECK(read.numbers == written.numbers);
    REQUIRE(traced.triangle_attribute("material") != nullptr);
    CHECK(traced.triangle_attribute("material")->values == mesh.triangle_attributes[0].values);
    CHECK(traced.triangle_attribute("flux") != nullptr);
}
