#include "levelset/levels.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>

#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

// A stack of one layer, whose distance is given.
MaterialStack stack_of(const Domain& domain, const std::function<double(const Vec3&)>& distance, double low,
                       double high) {
    MaterialStack stack{domain, {}};
    stack.layers.push_back({0, sample_grid(domain, distance, low, high)});
    redistance(*stack.layers[0].phi, domain, kSweepsAnew);
    return stack;
}

// By level: the columns that \p chosen(x, y) picks.
std::vector<LevelColumns> picked(const MaterialStack& stack,
                                 const std::function<bool(int x, int y)>& chosen) {
    std::vector<LevelColumns> result;
    for (const MaterialStack* level = &stack; level->coarser; level = level->coarser.get()) {
        LevelColumns columns = level->columns;
        for (int x = 0; x < columns.count[0]; ++x)
            for (int y = 0; y < columns.count[1]; ++y) columns.at(x, y) = chosen(x, y);
        result.push_back(columns);
    }
    return result;
}

// Directed edges that have no opposite, but for those on the domain's sides.
int open_edges(const TriangleMesh& mesh, const Domain& domain) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
    const auto on_side = [&](std::uint32_t v, int axis) {
        const auto a = static_cast<std::size_t>(axis);
        return mesh.vertices[v][axis] == domain.min[a] || mesh.vertices[v][axis] == domain.max[a];
    };
    int open = 0;
    for (const auto& [edge, n] : count) {
        const auto [a, b] = edge;
        if (n > 1) ++open;  // not manifold
        const auto back = count.find({b, a});
        if (back != count.end()) continue;
        if ((on_side(a, 0) && on_side(b, 0)) || (on_side(a, 1) && on_side(b, 1))) continue;
        ++open;
    }
    return open;
}

// V by layer and normal on every level.
using Law = std::function<double(std::size_t layer, const Vec3& normal)>;

Motion motion_of(const MaterialStack& stack, const Law& law) {
    Motion motion = make_motion(
        stack, extend_without_mesh(stack.top(), stack.domain),
        [law](std::size_t, std::size_t layer, const Vec3& n) { return law(layer, n); }, false);
    if (stack.coarser) motion.coarser = std::make_shared<const Motion>(motion_of(*stack.coarser, law));
    return motion;
}

// Moves the surface, choosing the columns anew as the time loop does; \p wanted(time step) may ask for more.
void move_levels(MaterialStack& stack, double duration, const AdvectionOptions& options, const Law& law,
                 const std::function<std::vector<LevelColumns>(int)>& wanted) {
    int time_step = 0;
    for (double time = 0.0; time < duration - 1e-12; ++time_step) {
        const Motion motion = motion_of(stack, law);
        const double left = duration - time, fastest = max_speed(stack, motion);
        const double dt =
            left /
            std::max(1.0, std::ceil(left * fastest / (options.cfl * stack.domain.spacing) * (1 - 1e-9)));
        advect(stack, motion, dt, options);
        if (stack.coarser && time_step % kTimeStepsBetweenChoices == 0)
            choose_columns(stack, wanted(time_step));
        time += dt;
    }
}

// Distances of the vertices from a level set that they should lie on.
struct Deviation {
    double mean = 0, max = 0;
};
Deviation deviation(const TriangleMesh& mesh, const std::function<double(const Vec3&)>& distance) {
    Deviation d;
    for (const Vec3& p : mesh.vertices) {
        const double off = std::abs(distance(p));
        d.mean += off / static_cast<double>(mesh.vertices.size());
        d.max = std::max(d.max, off);
    }
    return d;
}

double volume_of(const TriangleMesh& mesh) {
    double sum = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
    return sum;  // area_vector is twice the area
}

}  // namespace

TEST_CASE("levels meet in one closed surface, however the columns lie", "[levels]") {
    std::mt19937 random(1);
    for (const Side side : {Side::reflective, Side::periodic})
        for (const int levels : {2, 3})
            for (int turn = 0; turn < 4; ++turn) {
                const Domain domain = test::unit_domain(128, side);
                const double radius = 30.0 + 3.1 * turn;
                MaterialStack stack = stack_of(
                    domain, [=](const Vec3& p) { return (p - Vec3(0.3, 0.2, 0.1)).norm() - radius; }, -70,
                    70);
                const double volume = volume_of(extract_surface(stack));
                make_levels(stack, levels, 1);
                choose_columns(stack, picked(stack, [&](int, int) { return random() % 3 == 0; }));
                const TriangleMesh mesh = extract_surface(stack);
                const std::vector<std::size_t> voxels = voxels_by_level(stack);
                INFO(levels << " levels, turn " << turn);
                REQUIRE(std::count(stack.columns.own.begin(), stack.columns.own.end(), 0) > 4);
                REQUIRE(std::count(stack.columns.own.begin(), stack.columns.own.end(), 1) > 4);
                REQUIRE(*std::min_element(voxels.begin(), voxels.end()) > 1000);
                CHECK(open_edges(mesh, domain) == 0);
                CHECK(volume_of(mesh) == Approx(volume).epsilon(2e-3));
                const MaterialStack flat = on_one_level(stack);
                CHECK(volume_of(extract_surface(flat)) == Approx(volume).epsilon(2e-3));
            }
}

TEST_CASE("a front that grows across levels stays where one level has it", "[levels]") {
    const Domain domain = test::unit_domain(128);
    struct Case {
        const char* name;
        std::function<double(const Vec3&)> before, after;
    };
    const double grown = 6.0, slope = 0.3, length = std::hypot(1.0, slope);
    // In a domain with mirrors a slanted plane is a roof: its ridge is on the side, its slopes within.
    const Case cases[] = {
        {"sphere", [](const Vec3& p) { return (p - Vec3(3, 2, 0.4)).norm() - 42.0; },
         [=](const Vec3& p) { return (p - Vec3(3, 2, 0.4)).norm() - 42.0 - grown; }},
        {"plane", [=](const Vec3& p) { return (p.z() - slope * p.x()) / length - 0.3; },
         [=](const Vec3& p) { return (p.z() - slope * p.x()) / length - 0.3 - grown; }},
    };
    for (const Case& c : cases)
        for (const int levels : {2, 3}) {
            MaterialStack fine = stack_of(domain, c.before, -80, 80), stack = copy(fine);
            make_levels(stack, levels, 1);
            const auto half = [&](int) { return picked(stack, [](int x, int y) { return x < 2 && y < 3; }); };
            choose_columns(stack, half(0));
            const AdvectionOptions options;
            const Law law = [](std::size_t, const Vec3&) { return 1.0; };
            move_levels(fine, grown, options, law, half);
            move_levels(stack, grown, options, law, half);
            const TriangleMesh a = extract_surface(fine);
            const TriangleMesh b = extract_surface(stack);
            const Deviation of_one = deviation(a, c.after), of_levels = deviation(b, c.after);
            WARN(c.name << ", " << levels << " levels: mean " << of_one.mean << " and " << of_levels.mean
                        << ", max " << of_one.max << " and " << of_levels.max << ", volume " << volume_of(a)
                        << " " << volume_of(b) << " vox " << voxels_by_level(stack)[0] << " "
                        << voxels_by_level(stack)[1]);
            CHECK(open_edges(b, domain) == 0);
        }
}
