// Sidewall's collapse engine against CGAL and meshoptimizer on process-like surfaces: time, distance, shape.
//
//   simplify_bench [--repeat N] [--no-cgal] [--rough | MESH=GRID_SPACING ...]
//   simplify_bench --scaling [--repeat N]
//
// Without meshes: the study's surfaces; --rough: a trench with 0.03 dx of noise on its level set. Times are
// medians of N runs (5), wall clock, from our arrays to our arrays; distances are in dx, vertices to surface.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "simplify/cgal_lindstrom_turk.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/quality.hpp"
#include "tests/bench/measure.hpp"
#include "tests/bench/study_surfaces.hpp"
#include "tests/simplify/test_meshes.hpp"
#ifdef SIDEWALL_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

using namespace sidewall;
using simplify::kShapeWeights;
using simplify::kVolumeWeights;

namespace {

using Surface = bench::StudySurface;

/// Zero level of a field over a square of \p cells by \p cells, dx = 1, with noise at the grid's nodes.
TriangleMesh grow(int cells, double z_min, double z_max, const test::Field& field, double roughness) {
    const double half = 0.5 * cells;
    const levelset::Domain domain = levelset::make_domain(
        {2 * half, 2 * half}, 1.0, {levelset::Side::reflective, levelset::Side::reflective});
    const levelset::GridPtr grid =
        levelset::sample_grid(domain, test::rough(field, roughness), z_min - 4.0, z_max + 4.0);
    return levelset::extract_surface(*grid, domain);
}

/// Rounded mesas a few cells high on a gently bowed floor.
double low_relief(const Vec3& p) {
    const double pitch = 59.3, x = p.x() - pitch * std::round(p.x() / pitch),
                 y = p.y() - pitch * std::round(p.y() / pitch);
    const double edge = std::max(std::abs(x), std::abs(y)) - 17.2;
    const double mesa = test::rounded_corner(edge, p.z() - 9.3, 3.4);
    const double floor = p.z() - 0.4 - 0.6 * std::sin(0.031 * p.x()) * std::cos(0.027 * p.y());
    return -test::rounded_corner(-mesa, -floor, 2.6) * 0.98;
}

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <class Run>
double median_seconds(int repeat, const Run& run) {
    std::vector<double> seconds;
    for (int i = 0; i < repeat; ++i) {
        const double start = now();
        run();
        seconds.push_back(now() - start);
    }
    return bench::median(seconds);
}

#ifdef SIDEWALL_MESHOPTIMIZER
TriangleMesh meshoptimizer(const TriangleMesh& mesh, std::size_t target) {
    TriangleMesh result;
    std::vector<float> positions;
    for (const Vec3& p : mesh.vertices)
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(p[k]));
    const std::uint32_t* indices = mesh.triangles.data()->data();
    std::vector<std::uint32_t> out(3 * mesh.triangles.size());
    const std::size_t removed = mesh.vertices.size() - target;
    const std::size_t wanted = 3 * (mesh.triangles.size() - std::min(mesh.triangles.size(), 2 * removed));
    out.resize(meshopt_simplify(out.data(), indices, out.size(), positions.data(), mesh.vertices.size(),
                                3 * sizeof(float), wanted, 1.0f, 0, nullptr));
    std::vector<std::uint32_t> renamed(mesh.vertices.size(), 0xffffffffu);
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (renamed[out[i]] == 0xffffffffu) {
            renamed[out[i]] = static_cast<std::uint32_t>(result.vertices.size());
            result.vertices.push_back(mesh.vertices[out[i]]);
        }
        if (i % 3 == 0) result.triangles.emplace_back();
        result.triangles.back()[i % 3] = renamed[out[i]];
    }
    return result;
}
#endif

struct Entry {
    std::string name;
    std::function<TriangleMesh(std::size_t target)> run;
    bool reference;  ///< an engine of another library, sequential
};

std::vector<Entry> methods(const Surface& s, const std::vector<std::uint8_t>& features, bool cgal) {
    std::vector<Entry> list;
    for (const auto& [name, weights] : {std::pair{".5/.5/0", kVolumeWeights}, {".4/.3/.3", kShapeWeights}}) {
        if (cgal)
            list.push_back({fmt::format("cgal-lindstrom-turk {}", name),
                            [&s, weights](std::size_t target) {
                                return simplify::simplify_cgal_lindstrom_turk(
                                           s.mesh, {.target_vertices = target, .weights = weights})
                                    .mesh;
                            },
                            true});
        list.push_back({fmt::format("lindstrom-turk {}", name),
                        [&s, weights](std::size_t target) {
                            return simplify::simplify_lindstrom_turk(
                                       s.mesh, {.target_vertices = target, .weights = weights})
                                .mesh;
                        },
                        false});
    }
    list.push_back({"region-bounded .5/.5/0",
                    [&s, &features](std::size_t target) {
                        return simplify::simplify_regions_bounded(s.mesh, features,
                                                                  {.l0 = s.spacing,
                                                                   .step = s.spacing,
                                                                   .l_max = 3 * s.spacing,
                                                                   .target_vertices = target})
                            .mesh;
                    },
                    false});
    list.push_back({"region l0=dx .5/.5/0",
                    [&s, &features](std::size_t target) {
                        return simplify::simplify_regions(s.mesh, features,
                                                          {.l0 = s.spacing,
                                                           .step = s.spacing,
                                                           .l_max = 3 * s.spacing,
                                                           .target_vertices = target})
                            .mesh;
                    },
                    false});
#ifdef SIDEWALL_MESHOPTIMIZER
    list.push_back(
        {"meshoptimizer", [&s](std::size_t target) { return meshoptimizer(s.mesh, target); }, true});
#endif
    return list;
}

void compare(const Surface& s, int repeat, bool cgal) {
    const double start = now();
    const auto features = surface::feature_flags(s.mesh, s.spacing);
    fmt::print("\n{}: {} vertices, {} features at C = 0.5 ({:.3f} s), {} slivers\n", s.name,
               s.mesh.vertices.size(), std::count(features.begin(), features.end(), 1), now() - start,
               surface::measure_quality(s.mesh).slivers);
    const std::vector<Entry> list = methods(s, features, cgal);
    fmt::print("{:<30} {:>8} {:>9} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>8} {:>6}\n", "method", "removed",
               "vertices", "1 thr s", "2 thr s", "to: max", "mean", "back: max", "mean", "slivers", "degen");
    for (const double removed : {0.3, 0.5, 0.7, 0.8, 0.9}) {
        const auto target = static_cast<std::size_t>(
            std::ceil((1.0 - removed) * static_cast<double>(s.mesh.vertices.size())));
        for (const Entry& entry : list) {
            TriangleMesh result;
            const auto timed = [&](std::size_t threads) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
                return median_seconds(removed == 0.9 ? repeat : 1, [&] { result = entry.run(target); });
            };
            const double one = timed(1), two = entry.reference ? one : timed(2);
            const auto distance = surface::two_sided_distance(s.mesh, result);
            const auto quality = surface::measure_quality(result);
            fmt::print(
                "{:<30} {:>6.1f} % {:>9} {:>8.3f} {:>8.3f} {:>9.4f} {:>9.5f} {:>9.4f} {:>9.5f} {:>8} {:>6}\n",
                entry.name, 100.0 * (1.0 - double(result.vertices.size()) / double(s.mesh.vertices.size())),
                result.vertices.size(), one, two, distance.forward.max / s.spacing,
                distance.forward.mean / s.spacing, distance.backward.max / s.spacing,
                distance.backward.mean / s.spacing, quality.slivers, quality.degenerate);
            std::fflush(stdout);
        }
        fmt::print("\n");
    }
}

/// A line of /proc/self/status in bytes: VmRSS, or VmHWM, which is the largest VmRSS since reset_peak().
double memory(const std::string& key) {
    std::ifstream file("/proc/self/status");
    for (std::string word; file >> word;)
        if (double kilobytes = 0.0; word == key + ":" && file >> kilobytes) return 1024.0 * kilobytes;
    return 0.0;
}

void reset_peak() {
    std::ofstream("/proc/self/clear_refs") << 5;
}

void scaling(int repeat) {
    fmt::print("lindstrom-turk, 90 % removed, low relief\n{:>10} {:>8} {:>8} {:>13} {:>13} {:>13}\n",
               "vertices", "1 thr s", "2 thr s", "us/vertex, 1", "us/vertex, 2", "bytes/vertex");
    for (const int cells : {228, 914, 1828}) {
        const TriangleMesh mesh = grow(cells, 0.0, 10.0, low_relief, 0.03);
        const double n = static_cast<double>(mesh.vertices.size());
        const auto run = [&] {
            simplify::simplify_lindstrom_turk(mesh, {.target_vertices = mesh.vertices.size() / 10});
        };
        reset_peak();
        const double before = memory("VmRSS");
        run();
        const double bytes = memory("VmHWM") - before;
        std::array<double, 2> seconds{};
        for (const std::size_t threads : {1, 2}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            seconds[threads - 1] = median_seconds(repeat, run);
        }
        fmt::print("{:>10} {:>8.3f} {:>8.3f} {:>13.3f} {:>13.3f} {:>13.0f}\n", n, seconds[0], seconds[1],
                   1e6 * seconds[0] / n, 1e6 * seconds[1] / n, bytes / n);
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    return bench::run_bench("simplify_bench", [&] {
        int repeat = 5;
        bool cgal = true, scale = false, rough = false;
        std::vector<std::string> meshes;
        for (int i = 1; i < argc; ++i) {
            const std::string word = argv[i];
            if (word == "--scaling") {
                scale = true;
            } else if (word == "--no-cgal") {
                cgal = false;
            } else if (word == "--rough") {
                rough = true;
            } else if (word == "--repeat" && i + 1 < argc) {
                repeat = std::max(1, std::atoi(argv[++i]));
            } else {
                meshes.push_back(word);
            }
        }
        if (scale) {
            scaling(repeat);
            return;
        }
        if (rough) {
            compare({"rough trench", test::trench_mesh(0.1, 0.03), 0.1}, repeat, cgal);
            return;
        }
        for (const Surface& s : bench::surfaces_of(meshes)) compare(s, repeat, cgal);
    });
}
