#include "app/fit/fit_search.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Eigen::VectorXd;

namespace {

using Simulated = std::function<Residuals(const BoxPoint&)>;

LeastSquares problem(const Simulated& model, std::initializer_list<double> start, std::size_t runs) {
    LeastSquares asked{.evaluate =
                           [model](const std::vector<BoxPoint>& points) {
                               std::vector<Residuals> residuals;
                               for (const BoxPoint& x : points) {
                                   CHECK(x.minCoeff() >= 0.0);
                                   CHECK(x.maxCoeff() <= 1.0);
                                   residuals.push_back(model(x));
                               }
                               return residuals;
                           },
                       .max_runs = runs};
    asked.start = VectorXd::Map(start.begin(), static_cast<Eigen::Index>(start.size()));
    return asked;
}

double hump(double x, double at, double height, double width) {
    return height * std::exp(-0.5 * std::pow((x - at) / width, 2));
}

// A figure with a target of 1: a wide hump and one beside it stay below, a narrow one between reaches it.
Residuals three_humps(const BoxPoint& x) {
    const double figure =
        hump(x[0], 0.2, 0.8, 0.12) + hump(x[0], 0.88, 0.85, 0.08) + hump(x[0], 0.58, 1.0, 0.04);
    return VectorXd::Constant(1, figure - 1.0);
}

}  // namespace

TEST_CASE(
    "where downhill from the start ends at a minimum that misses the targets, a random search finds the one that meets them") {
    const LeastSquares asked = problem(three_humps, {0.25}, 120);
    const FitSearch downhill = search_least_squares(asked, "gauss-newton");
    CHECK(std::abs(downhill.found.best[0] - 0.58) > 0.2);
    CHECK_FALSE(downhill.several_minima);
    for (const char* method : {"auto", "crs"}) {
        const FitSearch search = search_least_squares(asked, method);
        INFO(method << " " << search.found.best << " in " << search.found.runs);
        CHECK(std::abs(search.found.residuals[0]) < 0.01);  // the target counts as met
        CHECK(search.found.best[0] == Approx(0.58).margin(0.01));
        CHECK(search.found.converged);
        CHECK(search.found.runs <= 120);
        CHECK(search.several_minima == (std::string(method) == "auto"));
    }
}

TEST_CASE(
    "auto looks from the far side too where the targets are missed, and no more where one minimum shows") {
    // Two targets that contradict one another by 0.2: one minimum, in the middle.
    const LeastSquares one = problem(
        [](const BoxPoint& x) {
            return Residuals(VectorXd{{x[0] - 0.6, x[0] - 0.4, x[1] - 0.3}});
        },
        {0.9, 0.9}, 60);
    const FitSearch search = search_least_squares(one, "auto");
    CHECK(search.found.best[0] == Approx(0.5).margin(0.01));
    CHECK(search.found.best[1] == Approx(0.3).margin(0.01));
    CHECK_FALSE(search.several_minima);
    CHECK(search.found.runs < 40);
    // Where the targets are met, auto takes no more runs than Gauss-Newton.
    const LeastSquares met = problem(
        [](const BoxPoint& x) {
            return Residuals(VectorXd{{x[0] - 0.6, x[1] - 0.3}});
        },
        {0.9, 0.9}, 60);
    CHECK(search_least_squares(met, "auto").found.runs ==
          search_least_squares(met, "gauss-newton").found.runs);
}

TEST_CASE("quadratic models of the sum find one parameter and several, and a minimum in a kink") {
    for (const Eigen::Index count : {1, 2, 3}) {
        const VectorXd truth = VectorXd::LinSpaced(count, 0.3, 0.6);
        LeastSquares asked = problem(
            [truth](const BoxPoint& x) {
                VectorXd r(x.size() + 1);
                r << (x.array().exp() - truth.array().exp()).matrix(), 0.1 * (x - truth).sum();
                return Residuals(r);
            },
            {0.9}, 80);
        asked.start = VectorXd::Constant(count, 0.9);
        const FitSearch search = search_least_squares(asked, "bobyqa");
        INFO(count << " " << search.found.best.transpose() << " in " << search.found.runs);
        CHECK((search.found.best - truth).lpNorm<Eigen::Infinity>() < 0.01);
        CHECK(search.found.converged);
        CHECK(search.found.runs <= 80);
        CHECK(search.found.half_interval.maxCoeff() < 1.0);
    }
    const LeastSquares kinked = problem(
        [](const BoxPoint& x) {
            return Residuals(VectorXd{{0.1 + std::abs(x[0] - 0.37), 0.2 + 2.0 * std::abs(x[1] - 0.61)}});
        },
        {0.1, 0.1}, 80);
    const FitSearch search = search_least_squares(kinked, "bobyqa");
    INFO(search.found.best.transpose() << " in " << search.found.runs);
    CHECK(search.found.best[0] == Approx(0.37).margin(0.01));
    CHECK(search.found.best[1] == Approx(0.61).margin(0.01));
}

TEST_CASE("every search gives the same answer again, keeps to its runs and lets errors through") {
    for (const char* method : {"auto", "gauss-newton", "bobyqa", "crs"}) {
        INFO(method);
        const Simulated holes = [](const BoxPoint& x) {
            return x[0] > 0.7 ? Residuals() : Residuals(VectorXd{{x[0] - 0.6, x[1] * x[1] - 0.09}});
        };
        for (const std::size_t runs : {1u, 3u, 8u, 32u, 33u, 70u}) {
            std::size_t count = 0;
            const LeastSquares asked = problem(
                [&](const BoxPoint& x) {
                    ++count;
                    return holes(x);
                },
                {0.2, 0.2}, runs);
            // The least is 33 runs: 7 first points, 12 of the random search and 14 at its end.
            if (std::string_view(method) == "crs" && runs < 33) {
                CHECK_THROWS_WITH(search_least_squares(asked, method), Catch::Contains("at least 33 runs"));
                CHECK(count == 0);
                continue;
            }
            const FitSearch first = search_least_squares(asked, method);
            CHECK(count == first.found.runs);
            CHECK(count <= runs);
            if (runs == 70) CHECK(first.found.best.isApprox(Eigen::Vector2d(0.6, 0.3), 0.02));
            CHECK(search_least_squares(asked, method).found.best == first.found.best);
        }
        std::size_t count = 0;
        const LeastSquares failing = problem(
            [&](const BoxPoint& x) -> Residuals {
                if (++count > 12) throw std::domain_error("stop");
                return holes(x);
            },
            {0.2, 0.2}, 70);
        CHECK_THROWS_AS(search_least_squares(failing, method), std::domain_error);
    }
}

TEST_CASE("every search ends at the lowest of all its runs, whatever they were made for") {
    // Hills and pits of all widths.
    const auto rough = [](unsigned seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        Eigen::Matrix<double, 18, 3> waves =
            Eigen::Matrix<double, 18, 3>::NullaryExpr([&] { return uniform(random); });
        return [waves](const BoxPoint& x) {
            VectorXd r{{x[0] - 0.4, 0.3 * (x[1] - 0.6), 0.2}};
            for (Eigen::Index k = 0; k < waves.rows(); ++k)
                r[k % 3] += 0.03 * std::sin(20.0 * waves.row(k).head<2>().dot(x) + 4.0 * waves(k, 2));
            return Residuals(r);
        };
    };
    for (const char* method : {"auto", "gauss-newton", "bobyqa", "crs"})
        for (unsigned seed = 0; seed < 40; ++seed)
            for (const std::size_t runs : {12u, 20u, 60u}) {
                if (std::string_view(method) == "crs" && runs < 33) continue;
                double least = std::numeric_limits<double>::infinity();
                const LeastSquares asked = problem(
                    [&, model = rough(seed)](const BoxPoint& x) {
                        const Residuals residuals = model(x);
                        least = std::min(least, residuals->squaredNorm());
                        return residuals;
                    },
                    {0.45, 0.32}, runs);
                const FitSearch search = search_least_squares(asked, method);
                const double sum = search.found.residuals.squaredNorm(),
                             noise = std::pow(search.found.noise, 2);
                INFO(method << ", seed " << seed << ", " << search.found.runs << " of " << runs << " runs");
                // Three standard deviations of the difference of two sums of three squared residuals; and the
                // gain of a step left out as it is a twentieth of an error long, with one degree of freedom.
                CHECK(sum <= least + 3.0 * std::sqrt(8.0 * noise * sum + 12.0 * noise * noise) +
                                 0.0025 * std::max(noise, sum));
            }
}
