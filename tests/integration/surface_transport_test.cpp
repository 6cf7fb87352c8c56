#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "app/process/simulation.hpp"
#include "tests/integration/run_program.hpp"

// Coverages that desorb, diffuse along the surface and fill a hole behind a front, against closed forms.
using namespace sidewall;
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

constexpr double kPi = std::numbers::pi;

// A hole of radius 1 and this depth, its floor silicon, wall and top mask, in a box of 2.5.
std::string hole(double depth, double spacing, const std::string& step, const std::string& flux) {
    return fmt::format(R"TOML([domain]
extent = [2.5, 2.5]
grid_spacing = {}
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "hole"
thickness = {}
radius = 1.0
[[step]]
model = "formula"
rate = 0
{}
[flux]
{}
[simplify]
method = "none"
)TOML",
                       spacing, depth, step, flux);
}

std::string flat(const std::string& step) {
    return R"TOML([domain]
extent = [2.0, 0.4]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
[[step]]
model = "formula"
rate = 0
)TOML" + step +
           "[flux]\nrays = 2000\n[simplify]\nmethod = \"none\"\n";
}

// The surfaces before every time step and at the end, and their times.
struct Course {
    std::vector<double> time;
    std::vector<std::shared_ptr<const app::TracedSurface>> surface;
};

Course course(const Folder& folder, const std::string& recipe, const std::string& output) {
    Course result;
    app::RunOptions options;
    options.output = folder.path / output;
    options.quiet = true;
    options.observe = [&](const app::Moment& moment) {
        result.time.push_back(moment.state.time);
        result.surface.push_back(moment.surface);
    };
    app::run_recipe(app::parse_recipe(recipe, "recipe.toml"), options);
    return result;
}

// Area-weighted mean over the wedges that `chosen` accepts.
struct Mean {
    double value = 0.0, area = 0.0;
};
template <class Chosen>
Mean mean_over(const app::TracedSurface& surface, const std::vector<double>& values, Chosen&& chosen) {
    Mean mean;
    const TriangleMesh& mesh = surface.traced();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!chosen(surface.arriving->materials[t], triangle_centroid(mesh, t),
                    area_vector(mesh, t).normalized()))
            continue;
        const double area = triangle_area(mesh, t);
        for (std::size_t k = 0; k < 3; ++k)
            mean.value += area / 3.0 * values[surface.arriving->wedges.corner[3 * t + k]];
        mean.area += area;
    }
    mean.value /= mean.area;
    return mean;
}

bool wall(int, const Vec3&, const Vec3& normal) {
    return std::abs(normal.z()) < 0.5;
}

double floor_flux(const app::TracedSurface& surface) {
    return mean_over(surface, surface.arriving->flux[0],
                     [](int, const Vec3& p, const Vec3& n) { return n.z() > 0.9 && p.z() < 0.1; })
        .value;
}

// Exchange between coaxial disks of radius 1 at this distance, over pi: Howell's C-41.
double disks(double distance) {
    const double x = 2.0 + distance * distance;
    return 0.5 * (x - std::sqrt(x * x - 4.0));
}

// A hole of radius 1 and this depth, its floor absorbing, its wall of equal rings: arrivals on each and on
// the floor.
class Rings {
  public:
    Rings(double depth, int count)
        : h_(depth / count), exchange_(count, count), opening_(count), floor_(count) {
        for (int i = 0; i < count; ++i) {
            for (int j = 0; j < count; ++j) {
                const double far = std::abs(i - j) * h_;
                exchange_(i, j) = i == j ? 2.0 * kPi * h_ - 2.0 * kPi * (1.0 - disks(h_))
                                         : kPi * (disks(far - h_) - 2.0 * disks(far) + disks(far + h_));
            }
            opening_[i] = kPi * (disks(i * h_) - disks((i + 1) * h_));
            floor_[i] = opening_[i];
        }
        floor_.reverseInPlace();
        straight_ = kPi * disks(depth);
    }
    double area() const { return 2.0 * kPi * h_; }
    Eigen::VectorXd wall(const Eigen::VectorXd& sticking) const {
        const Eigen::Index n = sticking.size();
        Eigen::MatrixXd balance = area() * Eigen::MatrixXd::Identity(n, n);
        balance -= exchange_ * (Eigen::VectorXd::Ones(n) - sticking).asDiagonal();
        return balance.partialPivLu().solve(opening_);
    }
    double floor(const Eigen::VectorXd& sticking) const {
        return (straight_ +
                floor_.dot(
                    (Eigen::VectorXd::Ones(sticking.size()) - sticking).cwiseProduct(wall(sticking)))) /
               kPi;
    }

  private:
    double h_;
    Eigen::MatrixXd exchange_;
    Eigen::VectorXd opening_, floor_;
    double straight_ = 0.0;
};

}  // namespace

TEST_CASE("a wall that desorbs all it adsorbs transmits what a wall without sticking does") {
    const Folder folder;
    const auto transmitted = [&](const std::string& name, const std::string& keys) {
        return floor_flux(
            *course(folder,
                    hole(2.0, 0.25, "duration = 1.0\n" + keys, "rays = 300000\nmethod = \"radiosity\""), name)
                 .surface.back());
    };
    const double plain =
        transmitted("plain", "species = [{ name = \"F\", sticking = { Si = 1, default = 0 } }]\n");
    // Clausing's value is 0.514, but for the corners of so coarse a grid; the tracer's own tests check it.
    CHECK(plain > 0.45);
    const double sticking =
        transmitted("sticking", "species = [{ name = \"F\", sticking = { Si = 1, default = 0.3 } }]\n");
    CHECK(sticking < 0.7 * plain);
    // theta = s G/(s G + k): what sticks, s G (1 - theta), is what leaves, k theta.
    const std::string species =
        "species = [{ name = \"F\", sticking = { Si = 1, default = \"0.6*(1 - theta)\" }, desorption = { Si = 0, "
        "default = \"0.2*theta\" } }]\n";
    const double balanced =
        transmitted("balanced", species + "coverages = { theta = \"0.6*F/(0.6*F + 0.2)\" }\n");
    CHECK(balanced == Approx(plain).epsilon(1e-3));
}

TEST_CASE("with no sink but the sky, coverage and flux come to the equilibrium of an open plane everywhere") {
    const Folder folder;
    // F = 1 and theta = s/(s + k) on top, wall and floor.
    for (const char* method : {"monte-carlo", "radiosity"}) {
        const std::string species =
            "duration = 40.0\ntime_steps = 20\nspecies = [{ name = \"F\", sticking = \"0.5*(1 - theta)\", desorption = "
            "\"0.25*theta\" }]\n";
        const Course slow = course(
            folder,
            hole(1.0, 0.25, species + "coverage_rates = { theta = \"0.5*F*(1 - theta) - 0.25*theta\" }\n",
                 fmt::format("rays = 50000\nmethod = \"{}\"", method)),
            std::string("slow-") + method);
        const app::TracedSurface& end = *slow.surface.back();
        const auto all = [](int, const Vec3&, const Vec3&) { return true; };
        const Mean theta = mean_over(end, end.arriving->coverage[0], all),
                   flux = mean_over(end, end.arriving->flux[0], all);
        CHECK(theta.value == Approx(2.0 / 3.0).epsilon(3e-3));
        CHECK(flux.value == Approx(1.0).epsilon(5e-3));
        const Mean deep = mean_over(end, end.arriving->coverage[0], wall);
        CHECK(deep.value == Approx(2.0 / 3.0).epsilon(0.01));
        // Before that the wall lags behind the top: the start was not the equilibrium.
        const app::TracedSurface& early = *slow.surface[1];
        CHECK(mean_over(early, early.arriving->coverage[0], wall).value <
              0.97 * mean_over(
                         early, early.arriving->coverage[0],
                         [](int, const Vec3&, const Vec3& n) { return n.z() > 0.9; })
                         .value);
    }
}

TEST_CASE("a source that waves along a flat wafer leaves the amplitude that diffusion allows, at all times") {
    // d theta/dt = a F (1 + cos k x) - b theta + D theta'': the wave is a (1 - exp(-(b + D k^2) t))/(b + D
    // k^2).
    const Folder folder;
    const double a = 0.3, b = 0.5, d = 0.2, k = kPi, rate = b + d * k * k;
    const Course run = course(folder, flat(R"TOML(duration = 1.0
time_steps = 40
species = [{ name = "F" }]
coverage_rates = { theta = "0.3*F*(1 + cos(pi*x)) - 0.5*theta" }
diffusion = { theta = 0.2 }
)TOML"),
                              "wave");
    REQUIRE(run.time.size() == 41);
    for (const std::size_t at : {10u, 20u, 40u}) {
        const app::TracedSurface& surface = *run.surface[at];
        const TriangleMesh& mesh = surface.traced();
        double wave = 0.0, norm = 0.0, sum = 0.0;
        for (std::size_t c = 0; c < surface.arriving->wedges.corner.size(); ++c) {
            const double x = mesh.vertices[mesh.triangles[c / 3][c % 3]].x();
            const double theta = surface.arriving->coverage[0][surface.arriving->wedges.corner[c]];
            const double area = triangle_area(mesh, c / 3) / 3.0;
            wave += area * theta * std::cos(k * x);
            norm += area * std::cos(k * x) * std::cos(k * x);
            sum += area * theta;
        }
        const double t = run.time[at], dt = 1.0 / 40;
        // Expected is backward Euler with steps of dt. The source's flux, a flat wafer's, is known to
        // 1/sqrt(rays a wedge) and averaged over the waves' many wedges: 2 %.
        const double exact = a / rate * (1.0 - std::pow(1.0 + rate * dt, -t / dt));
        CHECK(wave / norm == Approx(exact).epsilon(0.02));
        CHECK(sum / total_area(mesh) ==
              Approx(a / b * (1.0 - std::pow(1.0 + b * dt, -t / dt))).epsilon(0.02));
    }
}

TEST_CASE("a coverage diffuses only on the materials it is said to, and over creases of those") {
    const Folder folder;
    const auto end_of = [&](const std::string& keys, const std::string& name) {
        return course(
                   folder,
                   hole(
                       1.0, 0.25,
                       "duration = 1.0\ntime_steps = 4\nspecies = [{ name = \"F\", sticking = 1 }]\ncoverage_rates "
                       "= { theta = \"F*(depth > -0.99 ? 0 : 1)\" }\n" +
                           keys,
                       "rays = 20000"),
                   name)
            .surface.back();
    };
    // Only the mask's top gains.
    const auto mean = [&](const app::TracedSurface& surface, auto&& chosen) {
        return mean_over(surface, surface.arriving->coverage[0], chosen).value;
    };
    const auto on_wall = [](int, const Vec3& p, const Vec3& n) {
        return std::abs(n.z()) < 0.5 && p.z() < 0.7 && p.z() > 0.1;
    };
    const auto on_floor = [](int material, const Vec3&, const Vec3&) { return material == 0; };
    const auto still = end_of("", "still");
    CHECK(mean(*still, on_wall) == 0.0);
    const auto mask = end_of("diffusion = { theta = 0.5 }\ndiffuses_on = [\"Mask\"]\n", "mask");
    CHECK(mean(*mask, on_wall) > 0.1);
    CHECK(mean(*mask, on_floor) < 1e-12);
    const auto both = end_of("diffusion = { theta = 0.5 }\n", "both");
    CHECK(mean(*both, on_floor) > 0.005);
    // Diffusion moves the top's gain only: arrivals are the same to the last bit.
    const auto total = [](const app::TracedSurface& surface) {
        const Mean all = mean_over(surface, surface.arriving->coverage[0],
                                   [](int, const Vec3&, const Vec3&) { return true; });
        return all.value * all.area;
    };
    CHECK(total(*mask) == Approx(total(*still)).epsilon(1e-9));
    CHECK(total(*both) == Approx(total(*still)).epsilon(1e-9));
}

TEST_CASE("where a coverage cannot diffuse at a point, its neighbours keep theirs") {
    const Folder folder;
    const Course run = course(
        folder,
        flat("duration = 1.0\ntime_steps = 8\nspecies = [{ name = \"F\" }]\ncoverage_rates = { theta = "
             "\"0.5\" }\ndiffusion = { theta = \"x > 0 ? 1 : 0\" }\n"),
        "half");
    for (const double theta : run.surface.back()->arriving->coverage[0])
        CHECK(theta == Approx(0.5).epsilon(1e-9));
}

TEST_CASE("parabolic time steps that a late process time cannot tell apart are taken together") {
    const Folder folder;
    std::ofstream(folder.path / "late.toml") << R"toml(
[domain]
extent = [4.0]
grid_spacing = 0.5
[[layer]]
material = "Si"
[[step]]
model = "isotropic"
duration = 3600.0
rate = 0.0
[[step]]
model = "formula"
duration = 0.06
time_steps = 1000
time_spacing = "parabolic"
species = [{ name = "F", sticking = 1.0 }]
coverage_rates = { theta = "F*(1 - theta)" }
rate = 0
[flux]
rays = 1000
)toml";
    const Outcome outcome = run_program(folder.path, "run late.toml -o out --quiet", 60);
    INFO(outcome.output);
    CHECK(outcome.exit_code == 0);
    const std::string rows = read_bytes(folder.path / "out/timeline.csv");
    const auto count = std::count(rows.begin(), rows.end(), '\n');
    CHECK(count > 900);
    CHECK(count <= 1005);  // with the ends of both steps
}

TEST_CASE("parabolic time steps end at the squares, and at what is saved") {
    const Folder folder;
    const std::string step =
        "duration = 2.0\ntime_steps = 8\ntime_spacing = \"parabolic\"\nspecies = [{ name = \"F\" }]\ncoverage_rates = { theta = "
        "\"F - theta\" }\n";
    const Course run = course(folder, flat(step), "squares");
    REQUIRE(run.time.size() == 9);
    for (std::size_t k = 0; k <= 8; ++k)
        CHECK(run.time[k] == Approx(2.0 * static_cast<double>(k * k) / 64.0).margin(1e-12));
    const Course saved = course(folder, flat(step) + "[output]\nevery = 0.7\n", "saved");
    REQUIRE(saved.time.size() == 11);  // and 0.7, 1.4
    CHECK(saved.time[5] == Approx(0.7).margin(1e-12));
    CHECK(saved.time[6] == Approx(0.78125).margin(1e-12));
}

TEST_CASE("a front of coverage goes down a hole as rings of exact view factors say") {
    // Each site obeys n d theta/dt = G (1 - theta). Time is in n over the flux on the open wafer.
    const double depth = 4.0;
    const int count = 80;
    const Rings rings(depth, count);
    CHECK(rings.floor(Eigen::VectorXd::Zero(count)) == Approx(0.35657).epsilon(2e-3));  // Clausing
    // Knudsen's front, Gordon et al., Chem. Vap. Deposition 9 (2003) 73, with a tube's transmission 1/(1 + 3
    // z/8): n 2 pi dz = pi dt/(1 + 3 z/8), so t = 2 z + 3 z^2/8.
    const double duration = 0.6 * (2.0 * depth + 0.375 * depth * depth);
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(count);
    std::vector<Eigen::VectorXd> reference{theta};
    const int parts = 12, fine = 40;
    double time = 0.0;
    for (int p = 1; p <= parts; ++p) {
        const double end = duration * p * p / (parts * parts), dt = (end - time) / fine;
        for (int k = 0; k < fine; ++k) {
            const Eigen::VectorXd flux = rings.wall(Eigen::VectorXd::Ones(count) - theta);
            for (int i = 0; i < count; ++i) theta[i] = 1.0 - (1.0 - theta[i]) * std::exp(-flux[i] * dt);
        }
        time = end;
        reference.push_back(theta);
    }
    const Folder folder;
    const Course run = course(folder,
                              hole(depth, 0.25,
                                   fmt::format(R"TOML(duration = {}
time_steps = 36
time_spacing = "parabolic"
species = [{{ name = "F", sticking = {{ Si = 1, default = "1 - theta" }} }}]
coverage_rates = {{ theta = "F*(1 - theta)" }})TOML",
                                               duration),
                                   "rays = 20000"),
                              "front");
    REQUIRE(run.time.size() == 37);
    const auto filled = [&](const app::TracedSurface& surface) {
        const Mean mean = mean_over(surface, surface.arriving->coverage[0], wall);
        return mean.value;
    };
    for (const std::size_t p : {4u, 8u, 12u}) {
        const double exact = reference[p].mean(), got = filled(*run.surface[3 * p]);
        // Corners are cut by half a cell at the mouth and at the floor: the front stands within a cell.
        CHECK(depth * std::abs(got - exact) < 0.25);
    }
    // The front advances as the root of time in a hole deeper than wide: at 4/9, 2/3 and a little more.
    CHECK(filled(*run.surface[24]) / filled(*run.surface[36]) ==
          Approx(reference[8].mean() / reference[12].mean()).epsilon(0.03));
    // Estimate for a sharp front; the tolerance is due to the front's width of about a radius.
    const double z = (std::sqrt(4.0 + 1.5 * duration) - 2.0) / 0.75;
    CHECK(depth * reference[12].mean() == Approx(z).epsilon(0.15));
}

TEST_CASE(
    "a coverage that desorbs and diffuses is the same on any threads, and when it is resumed in the middle") {
    const Folder folder;
    std::ofstream(folder.path / "spread.toml") << R"TOML([domain]
extent = [2.0, 0.4]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 0.5
[[step]]
model = "formula"
duration = 1.0
time_steps = 12
time_spacing = "parabolic"
species = [{ name = "F", sticking = "0.5*(1 - theta)", desorption = "0.2*theta" }]
coverage_rates = { theta = "0.5*F*(1 - theta) - 0.2*theta" }
coverages = { bare = "1 - theta" }
diffusion = { theta = "0.1*bare" }
rate = "-0.2*theta"
[flux]
rays = 500
)TOML";
    const auto go = [&](const std::string& arguments) {
        const Outcome outcome = run_program(folder.path, "run spread.toml " + arguments);
        CAPTURE(outcome.output);
        CHECK(outcome.exit_code == 0);
    };
    go("-o one --threads 1 --set output.every=0.25");
    go("-o two --threads 2 --set output.every=0.25");
    const std::string last = read_bytes(folder.path / "one" / "surface_0004.vtp");
    CHECK(last.size() > 1000);
    CHECK(read_bytes(folder.path / "two" / "surface_0004.vtp") == last);
    const Outcome stopped =
        run_with_fault(folder.path, "kill 150", "run spread.toml -o three --set output.every=0.25");
    CHECK(stopped.exit_code != 0);
    CHECK(fs::exists(folder.path / "three" / "checkpoint.vdb"));
    CHECK_FALSE(fs::exists(folder.path / "three" / "summary.json"));
    CHECK(last_time(folder.path / "three") >= 0.25);
    go("-o three --set output.every=0.25 --resume");
    CHECK(read_bytes(folder.path / "three" / "surface_0004.vtp") == last);
}
