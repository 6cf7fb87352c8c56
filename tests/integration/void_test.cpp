#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "app/process/simulation.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/topology.hpp"
#include "tests/integration/run_program.hpp"

using namespace sidewall;

namespace {

// Volume within the domain of all voids below the wafer's surface: parts of the mesh that do not reach its
// top. The domain's sides across y close the voids: x n_x has no flux through them.
double void_volume(const TriangleMesh& mesh) {
    surface::DisjointSets sets(mesh.vertices.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        sets.join(a, b);
        sets.join(b, c);
    }
    std::uint32_t top = 0;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
        if (mesh.vertices[v].z() > mesh.vertices[top].z()) top = v;
    double volume = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (sets.root(mesh.triangles[t][0]) != sets.root(top))
            volume -= 0.5 * area_vector(mesh, t).x() * triangle_centroid(mesh, t).x();
    return volume;
}

}  // namespace

TEST_CASE("a void that deposition has closed off keeps its volume while the film grows on", "[slow]") {
    const test::Folder folder;
    for (const std::string method : {"none", "lindstrom-turk", "region-bounded"}) {
        // The recipe ends with the second surface after the first, on a closed void.
        const app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/pinch_off.toml",
                                                    {"step[0].duration=2.4", "simplify.method=" + method});
        REQUIRE(app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/pinch_off.toml").steps[0].duration ==
                Approx(2.0 * *recipe.output.every));
        app::run_recipe(recipe, {.output = folder.path, .overwrite = true, .quiet = true});
        const auto volume = [&](int n) {
            return void_volume(
                surface::read_mesh(folder.path / ("surface_000" + std::to_string(n) + ".vtp")));
        };
        const double closed = volume(2), later = volume(3), last = volume(4);
        CAPTURE(method, closed, later, last);
        CHECK(volume(0) == 0.0);
        CHECK(closed > 0.1);  // of the trench's 0.94 um^3
        CHECK(later == Approx(closed).epsilon(1e-3));
        CHECK(last == Approx(closed).epsilon(1e-3));
    }
}

TEST_CASE("speeds without particles do not reach into a closed void either", "[slow]") {
    const test::Folder folder;
    std::ifstream file(SIDEWALL_SOURCE_DIR "/configs/quick/pinch_off.toml");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    for (const std::string step : {"model = \"isotropic\"\nrate = -0.3\n",
                                   "model = \"isotropic\"\nrate = 0.3\ndeposit = \"Polymer\"\n",
                                   "model = \"directional\"\ndirectional = -0.1\nisotropic = -0.2\n"}) {
        app::run_recipe(app::parse_recipe(text + "\n[[step]]\nduration = 0.3\n" + step, "void.toml"),
                        {.output = folder.path, .overwrite = true, .quiet = true});
        const auto surface = [&](int n) {
            return surface::read_mesh(folder.path / ("surface_000" + std::to_string(n) + ".vtp"));
        };
        const double closed = void_volume(surface(2)), last = void_volume(surface(3));
        CAPTURE(step, closed, last);
        CHECK(closed > 0.1);
        // Where the speed depends on the normal, re-distancing rounds the edges of the void at rest a little.
        CHECK(last == Approx(closed).epsilon(3e-3));
        // The open surface has moved.
        const double before = bounding_box(surface(2)).max.z(), after = bounding_box(surface(3)).max.z();
        CHECK(std::abs(after - before) == Approx(0.3 * 0.3).margin(0.01));
    }
}
