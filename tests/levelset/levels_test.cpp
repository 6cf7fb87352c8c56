#include "levelset/layers/levels.hpp"

#include <tbb/global_control.h>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "levelset/layers/checkpoint.hpp"
#include "levelset/layers/level_features.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/shapes/shapes.hpp"
#include "surface/distance.hpp"
#include "surface/topology.hpp"
#include "tests/folder.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

Shape deep_trench() {
    Shape trench;
    trench.kind = ShapeKind::trench;
    trench.width = 20.0;
    trench.depth = 30.0;
    return trench;
}

// A stack of one layer with the given signed distance.
MaterialStack stack_of(const Domain& domain, const std::function<double(const Vec3&)>& distance, double low,
                       double high) {
    MaterialStack stack{domain, {}};
    stack.layers.push_back({0, sample_grid(domain, distance, low, high)});
    redistance(*stack.layers[0].phi, domain, kSweepsAnew);
    return stack;
}

// The columns of every level but the coarsest, set where \p chosen(x, y).
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

// Chooses about \p share of all columns at random, in squares of \p size x \p size columns.
std::function<bool(int x, int y)> drawn(std::mt19937& random, int size, double share) {
    constexpr std::size_t kSide = 32;
    std::vector<std::uint8_t> square(kSide * kSide);
    for (std::uint8_t& s : square) s = static_cast<double>(random() % 1000) < 1000.0 * share;
    return [square, size](int x, int y) {
        return square[static_cast<std::size_t>(x / size) * kSide + static_cast<std::size_t>(y / size)] != 0;
    };
}

// Whether every level but the coarsest is used in at least four columns and unused in at least four.
bool all_count_in_part(const MaterialStack& stack) {
    for (const MaterialStack* level = &stack; level->coarser; level = level->coarser.get())
        for (const int kind : {0, 1})
            if (std::count(level->columns.own.begin(), level->columns.own.end(), kind) < 4) return false;
    return true;
}

// Number of directed edges without an opposite, but for those on the domain's sides, or used twice.
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

// Speed by layer and normal, the same on every level.
using Law = std::function<double(std::size_t layer, const Vec3& normal)>;

Motion motion_of(const MaterialStack& stack, const Law& law) {
    Motion motion = test::motion_of(
        stack, extend_untraced(stack, nullptr, false),
        {.speed = [law](std::size_t, std::size_t layer, const Vec3& n) { return law(layer, n); }});
    if (stack.coarser) motion.coarser = std::make_shared<const Motion>(motion_of(*stack.coarser, law));
    return motion;
}

// Moves the surface and re-chooses the columns as the time loop does, also those of \p wanted(time step).
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

double volume_of(const TriangleMesh& mesh) {
    double sum = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
    return sum;  // twice the volume: area_vector is twice the area
}

}  // namespace

TEST_CASE("levels meet in one closed surface, however the columns lie", "[levels]") {
    std::mt19937 random(1);
    int in_part = 0;  // stacks, of 16
    for (const Side side : {Side::reflective, Side::periodic})
        for (const int levels : {2, 3})
            for (int turn = 0; turn < 4; ++turn) {
                const Domain domain = test::unit_domain(128, side);
                const double radius = 34.0 + 3.1 * turn;  // over 8 of the coarsest cells
                MaterialStack stack = stack_of(
                    domain, [=](const Vec3& p) { return (p - Vec3(0.3, 0.2, 0.1)).norm() - radius; }, -70,
                    70);
                const double volume = volume_of(extract_surface(stack));
                make_levels(stack, levels, 1);
                choose_columns(stack, picked(stack, turn % 2 == 0 && levels == 2 ? drawn(random, 1, 0.3)
                                                                                 : drawn(random, 3, 0.2)));
                const TriangleMesh mesh = extract_surface(stack);
                const std::vector<std::size_t> voxels = voxels_by_level(stack);
                INFO(levels << " levels, turn " << turn);
                in_part += all_count_in_part(stack);
                REQUIRE(std::count(stack.columns.own.begin(), stack.columns.own.end(), 0) > 4);
                REQUIRE(std::count(stack.columns.own.begin(), stack.columns.own.end(), 1) > 4);
                REQUIRE(*std::min_element(voxels.begin(), voxels.end()) > 1000);
                CHECK(open_edges(mesh, domain) == 0);
                CHECK(surface::analyse_topology(mesh).isolated_vertices == 0);
                CHECK(volume_of(mesh) == Approx(volume).epsilon(2e-3));
                const MaterialStack flat = on_one_level(stack);
                CHECK(volume_of(extract_surface(flat)) == Approx(volume).epsilon(2e-3));
            }
    CHECK(in_part >= 12);
}

TEST_CASE("a plane cuts what is around it as it cuts the whole front", "[levels]") {
    std::mt19937 random(2);
    for (const Side side : {Side::reflective, Side::periodic})
        for (const int levels : {1, 2, 3}) {
            const Domain domain = test::unit_domain(128, side);
            // Curved too little for a feature: the columns of features are always fine.
            const auto wave = [](double x) { return 8.0 * std::cos(x * std::numbers::pi / 64.0); };
            MaterialStack stack = stack_of(
                domain, [&](const Vec3& p) { return p.z() + 0.3 - wave(p.x()) - wave(p.y() + 3.0); }, -24,
                24);
            if (levels > 1) {
                make_levels(stack, levels, 1);
                choose_columns(stack, picked(stack, drawn(random, 1, 0.1)));
                REQUIRE(all_count_in_part(stack));
            }
            const TriangleMesh mesh = extract_surface(stack);
            const auto check = [&](const Vec3& normal, double offset) {
                const surface::Plane plane{normal, offset};
                const TriangleMesh around = extract_around(stack, 0, plane);
                INFO(levels << " levels, " << (side == Side::periodic) << ", " << normal.transpose() << ", "
                            << offset);
                CHECK(surface::profile_csv(surface::cut_by_plane(around, plane), plane) ==
                      surface::profile_csv(surface::cut_by_plane(mesh, plane), plane));
                return around.triangles.size();
            };
            for (int axis = 0; axis < 2; ++axis)
                for (const double at :
                     {-64.0, -63.99, -63.0, -60.0, -27.3, 0.0, 16.0, 17.7, 60.0, 62.5, 63.9, 64.0})
                    CHECK(check(2.0 * Vec3::Unit(axis), 2.0 * at) < mesh.triangles.size() / 2);
            CHECK(check(Vec3::UnitX(), 65.0) < mesh.triangles.size() / 2);
            check(Vec3::UnitZ(), 0.5);
            check(Vec3(1.0, -2.0, 0.0), 20.1);
        }
}

TEST_CASE("a plane stays one where columns of the coarser levels are cut off by the sides", "[levels]") {
    std::mt19937 random(1);
    const Law growth = [](std::size_t, const Vec3&) { return 1.0; };
    const auto [cells, levels] = GENERATE(table<int, int>(
        {{58, 2}, {66, 2}, {70, 2}, {72, 2}, {74, 2}, {116, 3}, {132, 3}, {140, 3}, {144, 3}}));
    const Side side = GENERATE(Side::reflective, Side::periodic);
    int deep_ones = 0, in_part = 0;
    for (int turn = 0; turn < 4; ++turn) {
        INFO(cells << " cells, " << levels << " levels, turn " << turn);
        MaterialStack stack = stack_of(
            test::unit_domain(cells, side), [](const Vec3& p) { return p.z() - 0.3; }, -20, 20);
        make_levels(stack, levels, 1);
        const auto chosen = [&] {
            return picked(stack, drawn(random, levels == 2 ? 1 + turn : 4, levels == 2 ? 0.7 : 0.3));
        };
        choose_columns(stack, chosen());
        in_part += all_count_in_part(stack);
        for (const MaterialStack* level = &stack; level->coarser; level = level->coarser.get()) {
            const LevelColumns deep = deep_columns(*level);
            deep_ones += static_cast<int>(std::count(deep.own.begin(), deep.own.end(), 1));
            bool alike = true;  // within each leaf of the coarser level
            for (int x = 0; x < deep.count[0]; ++x)
                for (int y = 0; y < deep.count[1]; ++y)
                    alike = alike && deep.at(x, y) == deep.at(x & ~1, y & ~1);
            CHECK(alike);
        }
        move_levels(stack, 6.0, {}, growth, [&](int) { return chosen(); });
        const TriangleMesh mesh = extract_surface(stack);
        double most = 0.0;
        for (const Vec3& p : mesh.vertices) most = std::max(most, std::abs(p.z() - 6.3));
        // Where a column drops two levels at once, the coarsest level's nodes at the front take values of the
        // middle level's nodes a cell and a half away. Re-distancing in place leaves these off by some
        // hundredths.
        CHECK(most < (levels == 2 ? 1e-3 : 0.04));
        CHECK(open_edges(mesh, stack.domain) == 0);
    }
    CHECK(deep_ones > 0);
    CHECK(in_part > 0);
}

TEST_CASE("a coarser level has the distances to a wall beyond a periodic side", "[levels]") {
    const Domain domain = test::unit_domain(64, Side::periodic);
    // A slot 30 deep with walls at 10 from the low side and 3.5 from the high one.
    MaterialStack stack = stack_of(
        domain,
        [&](const Vec3& p) {
            const double along = p.x() - 3.25, beside = std::abs(along - 64.0 * std::round(along / 64.0));
            return std::min(std::max(p.z(), beside - 25.25), p.z() + 30.0);
        },
        -40, 10);
    make_levels(stack, 2, 1);
    const MaterialStack& coarser = *stack.coarser;
    for (const double x : {0.0, 2.0})
        CHECK(distance_at(coarser.top(), coarser.domain, {domain.min[0] + x, 0.0, -16.0}) ==
              Approx(3.5 + x).margin(0.05));
}

TEST_CASE("a feature on a side is fine also in the last column, cut off by it", "[levels]") {
    // 29 coarse cells, an odd number; the side cuts a rod in half.
    const Domain domain = test::unit_domain(58);
    for (const double radius : {2.0, 3.0, 4.0}) {
        MaterialStack stack = stack_of(
            domain,
            [&](const Vec3& p) { return std::min(p.z(), std::hypot(p.x() - domain.max[0], p.z()) - radius); },
            -20, 20);
        make_levels(stack, 2, 1);
        INFO("radius " << radius);
        for (int y = 0; y < stack.columns.count[1]; ++y)
            CHECK(stack.columns.of_node(58, std::min(8 * y, 58)));
        CHECK_FALSE(stack.columns.of_node(0, 0));
    }
}

TEST_CASE("the largest speed is that of levels where they count", "[levels]") {
    // The finer level's speed is 1; the coarser level's is 3 where it counts and 7 where it does not.
    for (const bool low : {true, false}) {
        MaterialStack stack = stack_of(
            test::unit_domain(128), [](const Vec3& p) { return p.z() - 0.3; }, -20, 20);
        make_levels(stack, 2, 1);
        const auto is_fine = [=](int x) { return low ? x < 4 : x >= 12; };
        choose_columns(stack, picked(stack, [&](int x, int) { return is_fine(x); }));
        Motion motion = motion_of(stack, [](std::size_t, const Vec3&) { return 1.0; });
        Motion coarser = *motion.coarser;
        std::vector<double> speed;
        for (const auto& sample : coarser.extension.samples)
            speed.push_back(is_fine(sample.node.x() >> 2) ? 7.0 : 3.0);
        coarser.law.speed = [=](std::size_t sample, std::size_t, const Vec3&) { return speed[sample]; };
        motion.coarser = std::make_shared<const Motion>(std::move(coarser));
        CHECK(max_speed(stack, motion) == 3.0);
    }
}

TEST_CASE("a front that grows across levels is off by what their cells are", "[levels]") {
    // Chords of length h are off an arc of radius r by up to h^2 / 8 r: cells twice as large err four times
    // as much. A plane has no such error.
    const Domain domain = test::unit_domain(128);
    const double grown = 6.0, slope = 0.3, length = std::hypot(1.0, slope);
    struct Case {
        const char* name;
        std::function<double(const Vec3&)> distance;
        double half_width;  // of the part compared: mirrored at the sides, a slanted plane has ridges there
        double most;        // bound on the mean error over that of one level
    };
    const Case cases[] = {
        {"sphere", [](const Vec3& p) { return (p - Vec3(3, 2, 0.4)).norm() - 42.0; }, 64.0, 4.5},
        {"plane", [=](const Vec3& p) { return (p.z() - slope * p.x()) / length - 0.3; }, 50.0, 1.2},
    };
    for (const Case& c : cases)
        for (const int levels : {2, 3}) {
            MaterialStack fine = stack_of(domain, c.distance, -80, 80), stack = copy(fine);
            make_levels(stack, levels, 1);
            const auto part = [&](int) { return picked(stack, [](int x, int y) { return x < 4 && y < 6; }); };
            choose_columns(stack, part(0));
            const Law law = [](std::size_t, const Vec3&) { return 1.0; };
            move_levels(fine, grown, {}, law, part);
            move_levels(stack, grown, {}, law, part);
            const auto off = [&](const TriangleMesh& mesh) {
                Deviation d;
                double count = 0;
                for (const Vec3& p : mesh.vertices) {
                    if (std::abs(p.x()) > c.half_width) continue;
                    const double here = std::abs(c.distance(p) - grown);
                    d.mean += here, d.max = std::max(d.max, here), ++count;
                }
                return Deviation{d.mean / count, d.max};
            };
            const TriangleMesh mesh = extract_surface(stack);
            const Deviation one = off(extract_surface(fine)), several = off(mesh);
            INFO(c.name << ", " << levels << " levels: mean " << several.mean << " (" << one.mean
                        << "), most " << several.max << " (" << one.max << ")");
            CHECK(voxels_by_level(stack)[0] < voxels_by_level(fine)[0] / 2);
            CHECK(open_edges(mesh, domain) == 0);
            CHECK(several.mean < c.most * one.mean + 1e-4);
            CHECK(several.max < 0.05);
        }
}

TEST_CASE("a sharp corner and a thin film stay as on one level where levels meet", "[levels]") {
    // A fin with square edges along y, all columns of its left half fine, under a film first a quarter of a
    // cell thick.
    const Domain domain = make_domain({256.0, 32.0}, 1.0, {Side::reflective, Side::periodic});
    Shape fin;
    fin.kind = ShapeKind::fin;
    fin.width = 21.0;
    fin.height = 17.3;
    const Law growth = [](std::size_t, const Vec3&) { return 1.0; };
    MaterialStack fine = make_stack(domain, {{0, fin}});
    begin_film(fine, 1);
    MaterialStack stack = copy(fine);
    make_levels(stack, 3, 1);
    const auto half = [&](int) { return picked(stack, [](int x, int) { return x < 6; }); };
    for (const double thickness : {0.25, 3.0}) {
        move_levels(fine, thickness, {}, growth, half);
        move_levels(stack, thickness, {}, growth, half);
        const TriangleMesh a = extract_surface(fine), b = extract_surface(stack);
        const surface::TwoSidedDistance between = surface::two_sided_distance(a, b);
        INFO("film of " << thickness << " cells more");
        CHECK(open_edges(b, domain) == 0);
        CHECK(open_edges(extract_surface(stack, 0), domain) == 0);
        CHECK(between.max < 0.15);
        CHECK(between.mean < 0.01);
        CHECK(volume_of(b) == Approx(volume_of(a)).epsilon(1e-3));
        // The film's own volume, a small difference of large ones.
        const double film = volume_of(a) - volume_of(extract_surface(fine, 0));
        CHECK(volume_of(b) - volume_of(extract_surface(stack, 0)) == Approx(film).epsilon(0.01));
    }
    CHECK(10 * voxels_by_level(stack)[0] < 8 * voxels_by_level(fine)[0]);
}

TEST_CASE("a film that comes and goes costs the layer below the same on cells four times coarser",
          "[levels]") {
    // Each cycle grows 0.5 cells of film and etches 0.66: the film first, then the layer at a fifth of the
    // rate. In time steps of 0.22 cells, the last one begins with 0.06 cells of film, more than kExposed,
    // below which a film counts as none.
    const double film = 0.5, etch = 0.66, slower = 0.2;
    const int cycles = 10;
    const auto height = [&](int levels) {
        MaterialStack stack = stack_of(
            test::unit_domain(64), [](const Vec3& p) { return p.z() - 0.3; }, -20, 20);
        if (levels > 1) make_levels(stack, levels, 1);
        AdvectionOptions options;
        options.cfl = etch / 3.0;
        const auto none = [](int) { return std::vector<LevelColumns>(); };
        begin_film(stack, 1);
        for (int n = 0; n < cycles; ++n) {
            move_levels(
                stack, film, options, [](std::size_t, const Vec3&) { return 1.0; }, none);
            move_levels(
                stack, etch, options,
                [=](std::size_t layer, const Vec3&) { return layer == 0 ? -slower : -1.0; }, none);
        }
        CHECK((levels == 1 || voxels_by_level(stack)[0] == 0));
        double sum = 0.0;
        const TriangleMesh mesh = extract_surface(stack);
        for (const Vec3& p : mesh.vertices) sum += p.z() / static_cast<double>(mesh.vertices.size());
        return sum;
    };
    const double exact = 0.3 - cycles * slower * (etch - film);
    for (const int levels : {1, 2, 3}) {
        INFO(levels << " levels");
        CHECK(height(levels) == Approx(exact).margin(1e-3));
    }
}

TEST_CASE("levels that are made where they count are those of a stack made everywhere", "[levels]") {
    // The fin is thinner than a cell of the second level and lies between nodes of both coarser ones.
    const double length = GENERATE(
        128.0, 136.0, 132.0);  // along y: whole columns of a coarser level, of the finest, and half a one
    const Domain domain = make_domain({512.0, length}, 1.0, {Side::reflective, Side::periodic});
    Shape fin, film;
    fin.kind = ShapeKind::fin;
    fin.position = {1.0, 0.0};
    fin.width = 1.7;
    fin.height = 9.0;
    film.kind = ShapeKind::hole;
    film.top = 3.3;
    film.depth = 3.3;
    film.radius = 11.0;
    film.position = {100.0, -50.0};  // in the first column
    const std::vector<std::pair<int, Shape>> bodies{{0, fin}, {1, film}};
    MaterialStack whole = make_stack(domain, bodies);
    make_levels(whole, 3, 1);
    std::size_t made = 0;  // voxels sampled on the finest level
    const MaterialStack part = make_levels(domain, 3, 1, [&](const Domain& level, const LeafChoice& where) {
        MaterialStack stack = sample_stack(level, bodies, {}, where);
        if (level.spacing == domain.spacing) made = voxels_by_level(stack)[0];
        return stack;
    });
    CHECK(part.columns.own == whole.columns.own);
    CHECK(part.coarser->columns.own == whole.coarser->columns.own);
    CHECK(2 * made < voxels_by_level(make_stack(domain, bodies))[0]);
    int different = 0, compared = 0;
    for (std::size_t k = 0; k < 2; ++k)
        for (auto leaf = whole.layers[k].phi->tree().cbeginLeaf(); leaf; ++leaf) {
            if (!whole.columns.of_node(leaf->origin().x(), leaf->origin().y())) continue;
            const Leaf* other = part.layers[k].phi->tree().probeConstLeaf(leaf->origin());
            const bool same = other != nullptr && leaf->getValueMask() == other->getValueMask() &&
                              leaf->buffer() == other->buffer();
            different += same ? 0 : 1, ++compared;
        }
    CHECK(compared > 100);
    CHECK(different == 0);
    const surface::TwoSidedDistance between =
        surface::two_sided_distance(extract_surface(whole), extract_surface(part));
    CHECK(between.max < 0.01);
}

TEST_CASE("columns chosen at random for a thousand time steps leave no edge open", "[levels][slow]") {
    std::mt19937 random(7);
    const Domain domain = test::unit_domain(64, Side::periodic);
    MaterialStack stack = stack_of(
        domain, [](const Vec3& p) { return std::min((p - Vec3(1, 2, 0.4)).norm() - 21.0, p.z() + 9.3); }, -60,
        60);
    make_levels(stack, 3, 1);
    int open = 0, extracted = 0;
    for (int turn = 0; turn < 25; ++turn) {
        const double way = turn % 2 == 0 ? 1.0 : -1.0;
        move_levels(
            stack, 20.0, {}, [=](std::size_t, const Vec3& n) { return way * (0.7 + 0.3 * n.z() * n.z()); },
            [&](int) {
                open += open_edges(extract_surface(stack), domain), ++extracted;
                return picked(stack, [&](int, int) { return random() % 4 == 0; });
            });
    }
    CHECK(open == 0);
    CHECK(extracted >= 125);
}

TEST_CASE("a stack that is brought from several levels to one is saved as one, from a checkpoint, too",
          "[levels]") {
    const test::Folder folder;
    const auto file = folder.path / "checkpoint.vdb";
    const Domain domain = test::unit_domain(96);
    MaterialStack stack = make_stack(domain, {{0, deep_trench()}});
    make_levels(stack, 2, 1);
    save_checkpoint(file, stack, "");
    const MaterialStack one = on_one_level(load_checkpoint(file, domain).stack);
    save_checkpoint(file, one, "");
    const MaterialStack loaded = load_checkpoint(file, domain).stack;
    CHECK(!loaded.coarser);
    CHECK(extract_surface(loaded).vertices == extract_surface(one).vertices);
}

TEST_CASE("what is left of a layer is as much on several levels as on one", "[levels]") {
    const Domain domain = make_domain({128.0, 64.0}, 1.0, {Side::reflective, Side::periodic});
    const auto left = [&](int levels, double thickness) {
        Shape base, film, post;  // the film covers the wafer, and a post of it stands in the fine columns
        base.top = 0.1;
        film.top = 0.1 + thickness;
        post.kind = ShapeKind::box;
        post.size = {6.0, 6.0};
        post.height = 4.0;
        MaterialStack stack = make_stack(domain, {{0, base}, {1, film}, {1, post}});
        if (levels > 1) make_levels(stack, levels, 1);
        std::size_t start = 0;
        return volume_left(stack, 1, 1e9, start);
    };
    // Coarser levels count the film like the finest: planes have no error, and at borders of columns at most
    // one row of nodes in 16 counts too often or too rarely.
    const double wafer = 0.7 * 128.0 * 64.0;
    CHECK(left(1, 0.7) == Approx(wafer).epsilon(0.1));
    CHECK(left(2, 0.7) == Approx(left(1, 0.7)).epsilon(1.0 / 16.0));
    CHECK(left(3, 0.7) == Approx(left(1, 0.7)).epsilon(1.0 / 16.0));
    CHECK(left(3, 0.0) == Approx(left(1, 0.0)).epsilon(0.01));  // the post alone
}

TEST_CASE("several levels move to the same bits on any number of threads, and from a checkpoint",
          "[levels]") {
    const Domain domain = test::unit_domain(96);
    const auto moved = [&](std::size_t threads, bool through_a_file) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        MaterialStack stack = make_stack(domain, {{0, deep_trench()}});
        begin_film(stack, 1);
        make_levels(stack, 2, 1);
        const auto none = [](int) { return std::vector<LevelColumns>(); };
        const Law law = [](std::size_t, const Vec3&) { return 1.0; };
        move_levels(stack, 4.0, {}, law, none);
        if (through_a_file) {
            const test::Folder folder;
            save_checkpoint(folder.path / "checkpoint.vdb", stack, "text");
            stack = load_checkpoint(folder.path / "checkpoint.vdb", domain).stack;
        }
        move_levels(stack, 4.0, {}, law, none);
        return extract_surface(stack).vertices;
    };
    const auto one = moved(1, false);
    CHECK(one == moved(2, false));
    CHECK(one == moved(2, true));
}
