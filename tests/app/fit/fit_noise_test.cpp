#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/fit/fit_search.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Eigen::VectorXd;

namespace {

// Figures of a simulation whose relative errors are the same at all points that share a seed.
struct Simulator {
    double spread = 0.0;  // standard deviation of an error; half of its variance is common to all figures
    Eigen::Index figures = 1;

    VectorXd exact(const BoxPoint& x) const {
        const double second = x.size() > 1 ? x[1] : 0.4;
        return VectorXd::NullaryExpr(figures, [&](Eigen::Index i) {
            const auto t = 0.3 * static_cast<double>(i);
            return std::exp(x[0]) * (1.0 - 0.5 * t * second) + 0.2 * t * t * second;
        });
    }
    VectorXd run(const BoxPoint& x, std::mt19937& seed) const {
        std::normal_distribution<double> normal(0.0, spread * std::sqrt(0.5));
        const double shared = normal(seed);
        const VectorXd own = VectorXd::NullaryExpr(figures, [&] { return normal(seed); });
        return exact(x).cwiseProduct((own.array() + 1.0 + shared).matrix());
    }
};

struct Trials95 {
    std::string name;
    Eigen::Index parameters = 1, figures = 1;
    double noise = 0.0, error = 0.0;  // relative errors of the simulation and of the targets
    bool known = false;               // whether the targets' error is given
};

// Share of the parameters' intervals that hold the truth.
double share_held(const Trials95& c, int trials, bool repeats) {
    const VectorXd truth = VectorXd::LinSpaced(c.parameters, 0.35, 0.6);
    const Simulator simulator{c.noise, c.figures};
    int held = 0;
    for (int trial = 0; trial < trials; ++trial) {
        std::mt19937 random(static_cast<unsigned>(trial) + 1);
        std::normal_distribution<double> normal(0.0, c.error);
        VectorXd target = simulator.exact(truth);
        for (double& t : target) t *= 1.0 + normal(random);
        const auto residuals = [&](const VectorXd& figures) {
            const double scale = c.known ? c.error : 1.0;
            return Residuals(VectorXd((figures - target).cwiseQuotient(scale * target)));
        };
        const auto seed = random();
        LeastSquares asked{.start = VectorXd::Constant(c.parameters, 0.5),
                           .evaluate =
                               [&](const std::vector<BoxPoint>& points) {
                                   std::vector<Residuals> all;
                                   for (const BoxPoint& x : points) {
                                       std::mt19937 same(seed);
                                       all.push_back(residuals(simulator.run(x, same)));
                                   }
                                   return all;
                               },
                           .known_errors = c.known};
        if (repeats)
            asked.repeat = [&](const BoxPoint& x, std::size_t count) {
                std::vector<Residuals> all;
                for (std::size_t k = 0; k < count; ++k) all.push_back(residuals(simulator.run(x, random)));
                return all;
            };
        const LeastSquaresResult found = search_least_squares(asked, "gauss-newton").found;
        CHECK(found.repeats.cols() == (repeats ? static_cast<Eigen::Index>(kRepeats) : 0));
        for (Eigen::Index k = 0; k < c.parameters; ++k)
            held += std::abs(found.best[k] - truth[k]) <= found.half_interval[k] ? 1 : 0;
    }
    return static_cast<double>(held) / static_cast<double>(trials * static_cast<int>(c.parameters));
}

}  // namespace

TEST_CASE(
    "95 % intervals hold the truth in 95 % of fits whose runs share random numbers, with few targets and many, exact and "
    "measured",
    "[slow]") {
    constexpr int kTrials = 400;
    // Three standard deviations. The parameters of one fit have correlated errors and count as one.
    const double bar = 3.0 * std::sqrt(0.95 * 0.05 / kTrials);
    for (const Trials95& c : {Trials95{"as many targets as keys", 1, 1, 0.01},
                              {"two of each", 2, 2, 0.01},
                              {"exact targets", 2, 8, 0.01},
                              {"targets as uncertain as runs", 2, 8, 0.01, 0.01},
                              {"targets far more uncertain", 2, 8, 0.001, 0.01},
                              {"stated errors, precise runs", 2, 8, 0.001, 0.01, true},
                              {"stated errors as large as the noise", 1, 3, 0.01, 0.01, true},
                              {"stated errors below the noise", 1, 1, 0.01, 0.002, true}}) {
        const double held = share_held(c, kTrials, true);
        INFO(c.name << ": " << held);
        CHECK(held > 0.95 - bar);
        CHECK(held < 0.999);
    }
    // Without repeated runs the noise stays hidden and the intervals are too narrow.
    CHECK(share_held({"hidden", 1, 1, 0.01}, 100, false) < 0.5);
}

TEST_CASE(
    "runs that only tell the noise are a quarter of all at most, and none where no spread can be told") {
    for (const auto& [most, repeats] : {std::pair{60u, 6u}, {24u, 6u}, {12u, 3u}, {8u, 2u}, {7u, 0u}}) {
        std::size_t count = 0, again = 0;
        LeastSquares asked{.start = VectorXd::Constant(1, 0.2),
                           .evaluate =
                               [&](const std::vector<BoxPoint>& points) {
                                   count += points.size();
                                   std::vector<Residuals> all;
                                   for (const BoxPoint& x : points)
                                       all.emplace_back(VectorXd::Constant(1, x[0] - 0.4));
                                   return all;
                               },
                           .repeat =
                               [&](const BoxPoint&, std::size_t runs) {
                                   again = runs;
                                   std::vector<Residuals> all(runs);  // the first run fails
                                   for (std::size_t k = 1; k < runs; ++k)
                                       all[k] = VectorXd::Constant(1, 0.01 * static_cast<double>(k));
                                   return all;
                               },
                           .max_runs = most};
        const LeastSquaresResult found = search_least_squares(asked, "auto").found;
        INFO(most);
        CHECK(again == repeats);
        CHECK(count + again <= most);
        CHECK(found.repeats.cols() == static_cast<Eigen::Index>(repeats > 0 ? repeats - 1 : 0));
    }
}

TEST_CASE("a figure that goes by steps of the grid is noticed, and its interval holds the step") {
    const auto fitted = [](const auto& figures, Eigen::Index parameters) {
        LeastSquares asked{.start = VectorXd::Constant(parameters, 0.3),
                           .evaluate = [&](const std::vector<BoxPoint>& points) {
                               std::vector<Residuals> all;
                               for (const BoxPoint& x : points) all.emplace_back(figures(x));
                               return all;
                           }};
        return search_least_squares(asked, "gauss-newton").found;
    };
    // A depth in whole steps of 0.05, with a target of 0.62.
    const LeastSquaresResult stepped = fitted(
        [](const BoxPoint& x) {
            return VectorXd{{std::floor(x[0] / 0.05) * 0.05 - 0.62, x[0] - 0.6}};
        },
        1);
    INFO(stepped.grid_steps.transpose() << ", " << stepped.best << " +- " << stepped.half_interval);
    REQUIRE(stepped.grid_steps.size() == 2);
    CHECK(stepped.grid_steps[0] > 0.0);
    CHECK(stepped.grid_steps[0] < 0.2);
    CHECK(stepped.grid_steps[1] == 0.0);
    CHECK(std::abs(stepped.best[0] - 0.62) < stepped.half_interval[0]);
    // Figures that depend on one key or on none stay equal between points, which shows no step of the grid.
    const LeastSquaresResult smooth = fitted(
        [](const BoxPoint& x) {
            return VectorXd{{x[0] * x[0] - 0.25, std::exp(x[1]) - 1.5, 0.1}};
        },
        2);
    CHECK(smooth.grid_steps.isZero(0.0));
    CHECK(smooth.best.isApprox(Eigen::Vector2d(0.5, std::log(1.5)), 0.01));
}

TEST_CASE("figures that are equal by chance, within the noise of six digits, are no steps of the grid") {
    int noticed = 0;
    for (unsigned trial = 0; trial < 300; ++trial) {
        std::mt19937 random(trial);
        std::normal_distribution<double> normal(0.0, 0.002);
        const auto run = [&](const BoxPoint& x) {  // rough: every point has its own noise
            return Residuals(VectorXd{{std::round(1e6 * (x[0] - 0.6 + normal(random))) * 1e-6,
                                       std::round(1e6 * (x[1] - 0.4 + normal(random))) * 1e-6}});
        };
        LeastSquares asked{.start = VectorXd::Constant(2, 0.3),
                           .evaluate =
                               [&](const std::vector<BoxPoint>& points) {
                                   std::vector<Residuals> all;
                                   for (const BoxPoint& x : points) all.push_back(run(x));
                                   return all;
                               },
                           .repeat =
                               [&](const BoxPoint& x, std::size_t count) {
                                   std::vector<Residuals> all;
                                   for (std::size_t k = 0; k < count; ++k) all.push_back(run(x));
                                   return all;
                               }};
        noticed += search_least_squares(asked, "gauss-newton").found.grid_steps.isZero(0.0) ? 0 : 1;
    }
    // The noise has 2000 rounding units: two of some 15 points meet in few fits of 100, three in 1 of 10,000.
    CHECK(noticed == 0);
}

TEST_CASE("a model without random numbers has intervals from how rough it is over its keys") {
    LeastSquares asked{
        .start = VectorXd::Constant(1, 0.3),
        .evaluate =
            [](const std::vector<BoxPoint>& points) {
                std::vector<Residuals> all;
                for (const BoxPoint& x : points)
                    all.emplace_back(VectorXd::Constant(1, x[0] - 0.6 + 0.001 * std::sin(7e4 * x[0])));
                return all;
            },
        .repeat =
            [](const BoxPoint& x, std::size_t count) {
                return std::vector<Residuals>(
                    count, VectorXd::Constant(1, x[0] - 0.6 + 0.001 * std::sin(7e4 * x[0])));
            }};
    const LeastSquaresResult found = search_least_squares(asked, "auto").found;
    INFO(found.best << " +- " << found.half_interval << ", " << found.noise);
    CHECK(found.best[0] == Approx(0.6).margin(0.003));
    CHECK(found.half_interval[0] > 1e-4);
    CHECK(found.half_interval[0] < 0.01);
}
