#include "app/fit/least_squares.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "app/fit/fit_errors.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

using FiguresOf = std::function<VectorXd(const BoxPoint&)>;

// Four curved figures of three parameters, like a film's thickness at places on, in and under a trench.
VectorXd film(const BoxPoint& x) {
    const double rate = std::exp(x[0]), sticking = std::exp(2.0 * (x[1] - 1.0)), exponent = 1.0 + 4.0 * x[2];
    VectorXd f(4);
    f << rate, rate * std::pow(1.0 - 0.8 * sticking, 2),
        rate * (0.3 + 0.1 * std::log(exponent)) / (0.4 + sticking), rate * (1.0 - 0.5 * sticking);
    return f;
}

VectorXd point(std::initializer_list<double> values) {
    VectorXd x(static_cast<Eigen::Index>(values.size()));
    std::copy(values.begin(), values.end(), x.data());
    return x;
}

LeastSquares problem(const FiguresOf& model, const VectorXd& start) {
    return {.start = start, .evaluate = [model](const std::vector<BoxPoint>& points) {
                std::vector<Residuals> residuals;
                for (const BoxPoint& x : points) residuals.emplace_back(model(x));
                return residuals;
            }};
}

// A pseudo-random number from -1 to 1 that depends on the point alone.
double scatter(const BoxPoint& x, double which) {
    const double mixed =
        std::sin(which * 12.9898 + 7.0e4 * x.dot(VectorXd::LinSpaced(x.size(), 1.0, 2.0))) * 43758.5453;
    return 2.0 * (mixed - std::floor(mixed)) - 1.0;
}

}  // namespace

TEST_CASE(
    "a fit finds three parameters within 40 runs from any start, smooth or with half a percent of noise") {
    const VectorXd truth = point({0.35, 0.6, 0.45});
    for (const double noise : {0.0, 0.005}) {
        const FiguresOf model = [&](const BoxPoint& x) {
            VectorXd f = film(x), target = film(truth);
            for (Eigen::Index i = 0; i < f.size(); ++i)
                f[i] *= 1.0 + noise * scatter(x, static_cast<double>(i));
            return VectorXd((f - target).cwiseQuotient(target));
        };
        for (const VectorXd& start : {point({0.1, 0.1, 0.1}), point({0.9, 0.9, 0.9}), point({0.0, 1.0, 0.5}),
                                      point({1.0, 0.0, 1.0}), point({0.5, 0.5, 0.5})}) {
            LeastSquares asked = problem(model, start);
            asked.max_runs = 40;
            const LeastSquaresResult found = fit_least_squares(asked);
            INFO("noise " << noise << " found " << found.best.transpose() << " in " << found.runs << " half "
                          << found.half_interval.transpose());
            CHECK(found.runs <= 40);
            if (noise == 0.0) CHECK(found.free_directions.empty());
            // Uniform noise of +-0.5 % has a standard deviation of 0.29 %; the exponent enters its figure as
            // a tenth of its logarithm, so that its error is larger.
            const double most = noise == 0.0 ? 0.002 : 0.05;
            CHECK((found.best - truth).lpNorm<Eigen::Infinity>() < most);
            if (noise == 0.0) CHECK(found.converged);
        }
    }
}

TEST_CASE("95 % intervals hold the truth in nearly all of 20 trials, with known and with estimated errors") {
    const VectorXd truth = point({0.35, 0.6});
    const auto line = [&](const BoxPoint& x, double t) { return x[0] * std::exp(-2.0 * x[1] * t); };
    for (const bool known : {true, false}) {
        int inside = 0;
        for (unsigned trial = 0; trial < 20; ++trial) {
            std::mt19937 random(trial);
            std::normal_distribution<double> normal(0.0, 0.01);
            VectorXd target(8);
            for (Eigen::Index i = 0; i < 8; ++i)
                target[i] = line(truth, 0.2 * static_cast<double>(i)) + normal(random);
            LeastSquares asked = problem(
                [&](const BoxPoint& x) {
                    VectorXd r(8);
                    for (Eigen::Index i = 0; i < 8; ++i)
                        r[i] = (line(x, 0.2 * static_cast<double>(i)) - target[i]) / (known ? 0.01 : 1.0);
                    return r;
                },
                point({0.5, 0.5}));
            asked.known_errors = known;
            const LeastSquaresResult found = fit_least_squares(asked);
            CHECK(found.converged);
            for (Eigen::Index i = 0; i < 2; ++i)
                inside += std::abs(found.best[i] - truth[i]) <= found.half_interval[i] ? 1 : 0;
            CHECK(found.half_interval.maxCoeff() < 0.2);
        }
        // Fewer than 34 of 40 intervals of 95 % hold the truth once in 200 times.
        CHECK(inside >= 34);
        CHECK(inside <= 40);
    }
}

TEST_CASE("parameters that act as a product only are told from those that can be found") {
    const FiguresOf model = [](const BoxPoint& x) {
        const double product = (0.5 + x[0]) * (0.5 + x[1]);
        return point({product - 1.1, std::exp(-product) - std::exp(-1.1) + x[2] - 0.4,
                      product * product * x[2] - 0.484});
    };
    const LeastSquaresResult found = fit_least_squares(problem(model, point({0.2, 0.7, 0.8})));
    REQUIRE(found.free_directions.size() == 1);
    const VectorXd& free = found.free_directions[0];
    CHECK(std::abs(free[0]) > 0.3);
    CHECK(std::abs(free[1]) > 0.3);
    CHECK(std::abs(free[2]) < 0.1);
    CHECK(std::abs(found.best[2] - 0.4) < 0.01);
    CHECK(found.half_interval[2] < 0.05);
    CHECK(found.half_interval[0] > 100.0);
}

TEST_CASE("a parameter that nothing depends on is free, and the others are found") {
    const LeastSquaresResult found = fit_least_squares(problem(
        [](const BoxPoint& x) {
            return point({x[0] - 0.3, 2.0 * (x[0] - 0.3)});
        },
        point({0.9, 0.5})));
    REQUIRE(found.free_directions.size() == 1);
    CHECK(std::abs(found.free_directions[0][1]) > 0.99);
    CHECK(found.best[0] == Approx(0.3).margin(0.002));
}

TEST_CASE("a fit stays in the box, passes by points without residuals and keeps to its runs") {
    const LeastSquaresResult corner = fit_least_squares(problem(
        [](const BoxPoint& x) {
            CHECK(x.minCoeff() >= 0.0);
            CHECK(x.maxCoeff() <= 1.0);
            return point({x[0] - 1.5, x[1] + 0.5, x[0] * x[1]});
        },
        point({0.5, 0.5})));
    CHECK(corner.best.isApprox(point({1.0, 0.0}), 1e-6));

    LeastSquares holes = problem(nullptr, point({0.2, 0.2}));
    std::size_t count = 0;
    holes.evaluate = [&](const std::vector<BoxPoint>& points) {
        std::vector<Residuals> residuals;
        for (const BoxPoint& x : points) {
            ++count;
            residuals.push_back(x[0] > 0.7 ? Residuals()
                                           : Residuals(point({x[0] - 0.6, std::exp(x[1]) - 1.5})));
        }
        return residuals;
    };
    const LeastSquaresResult found = fit_least_squares(holes);
    CHECK(found.best.isApprox(point({0.6, std::log(1.5)}), 0.01));
    CHECK(found.runs == count);

    for (const std::size_t runs : {1u, 2u, 5u}) {
        count = 0;
        holes.max_runs = runs;
        const LeastSquaresResult few = fit_least_squares(holes);
        CHECK_FALSE(few.converged);
        CHECK(count <= runs);
        if (runs > 1) continue;
        CHECK(few.free_directions.empty());
        CHECK(few.half_interval.minCoeff() > 100.0);
    }
    holes.evaluate = [](const std::vector<BoxPoint>& points) {
        return std::vector<Residuals>(points.size());
    };
    CHECK_THROWS_AS(fit_least_squares(holes), NumericsError);
}

TEST_CASE("Student's quantiles agree with the tables") {
    for (const auto& [degrees, quantile] : {std::pair{1, 12.706},
                                            {2, 4.303},
                                            {3, 3.182},
                                            {4, 2.776},
                                            {5, 2.571},
                                            {10, 2.228},
                                            {30, 2.042},
                                            {1000, 1.962}})
        CHECK(student_quantile(degrees) == Approx(quantile).epsilon(0.002));
}
