// CPU seconds, from the extracted mesh on, to a relative L2 error of 2 % of the flux at its vertices, in
// every tenth of the depth and on the floor. Five methods: top-down raw, smoothed and simplified, radiosity
// raw and simplified.
//
//     five_ways_bench [MESH=GRID_SPACING ...]
//
// Without meshes: the study's surfaces. Simplified: 90 % of the vertices removed.
#include "app/common/timing.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "tests/bench/five_ways/five_ways.hpp"
#include "tests/bench/study_surfaces.hpp"

using namespace sidewall;

namespace {

bench::SimplifiedMesh simplified(const bench::StudySurface& surface, const char* name,
                                 simplify::Method method) {
    simplify::Options options;
    options.method = method;
    options.weights = simplify::kVolumeWeights;
    options.grid_spacing = surface.spacing;
    options.target_vertices = surface.mesh.vertices.size() / 10;
    std::vector<std::uint8_t> flags;
    const double start = app::cpu_seconds();
    if (simplify::reads_features(method)) {
        options.l0 = surface.spacing;  // features are coarsened, too
        flags = surface::feature_flags(surface.mesh, surface.spacing);
    }
    TriangleMesh mesh = simplify::simplify(surface.mesh, flags, options).mesh;
    return {name, std::move(mesh), app::cpu_seconds() - start};
}

void compare_ways(const bench::StudySurface& surface) {
    using simplify::Method;
    std::vector<bench::SimplifiedMesh> meshes{{"raw", surface.mesh, 0.0}};
    for (const auto& [name, method] : {std::pair{"lindstrom-turk 0.5/0.5/0", Method::lindstrom_turk},
                                       {"region", Method::region},
                                       {"region-bounded", Method::region_bounded}})
        meshes.push_back(simplified(surface, name, method));
    const flux::LateralBox box =
        flux::lateral_box(surface.mesh, {flux::Boundary::reflective, flux::Boundary::reflective});
    const app::Json entries = bench::five_ways(
        meshes, box, {.before_turn = [](const std::string& what) { fmt::print(stderr, "{}\n", what); }});
    fmt::print("{}", bench::five_ways_table(surface.name, entries));
    for (const app::Json& entry : entries)
        fmt::print("\n{}, sticking {}:\n{}", surface.name, entry["sticking"].get<double>(),
                   bench::depth_table(entry));
}

}  // namespace

int main(int argc, char** argv) {
    return bench::run_bench("five_ways_bench", [&] {
        for (const bench::StudySurface& surface : bench::surfaces_of({argv + 1, argv + argc}))
            compare_ways(surface);
    });
}
