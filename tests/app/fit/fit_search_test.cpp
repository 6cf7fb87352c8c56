#include "app/fit/fit_search.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
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

// A figure that is to be 1: a wide hump and one beside it fall short, a narrow one between them reaches it.
Residuals three_humps(const BoxPoint& x) {
    const double figure =
        hump(x[0], 0.2, 0.8, 0.12) + hump(x[0], 0.88, 0.85, 0.08) + hump(x[0], 0.58, 1.0, 0.04);
    return VectorXd::Constant(1, figure - 1.0);
}

}  // namespace

TEST_CASE(
    "where both sides end at minima that miss the targets, the lower one is taken and there are several") {
    const FitSearch search = search_least_squares(problem(three_humps, {0.25}, 120));
    INFO(search.found.best << " in " << search.found.runs);
    CHECK(search.several_minima);
    CHECK(search.found.best[0] == Approx(0.88).margin(0.02));
    CHECK(search.found.converged);
    CHECK(search.found.runs <= 120);
}

TEST_CASE(
    "a search looks from the far side too where the targets are missed, and no more where one minimum shows") {
    // Two targets that contradict one another by 0.2: one minimum, in the middle.
    const LeastSquares one = problem(
        [](const BoxPoint& x) {
            return Residuals(VectorXd{{x[0] - 0.6, x[0] - 0.4, x[1] - 0.3}});
        },
        {0.9, 0.9}, 60);
    const FitSearch search = search_least_squares(one);
    CHECK(search.found.best[0] == Approx(0.5).margin(0.01));
    CHECK(search.found.best[1] == Approx(0.3).margin(0.01));
    CHECK_FALSE(search.several_minima);
    CHECK(search.found.runs < 40);
    // Met targets take not one run more than Gauss-Newton.
    const LeastSquares met = problem(
        [](const BoxPoint& x) {
            return Residuals(VectorXd{{x[0] - 0.6, x[1] - 0.3}});
        },
        {0.9, 0.9}, 60);
    CHECK(search_least_squares(met).found.runs == fit_least_squares(met).runs);
}

TEST_CASE("every search gives the same answer again, keeps to its runs and lets errors through") {
    {
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
            const FitSearch first = search_least_squares(asked);
            CHECK(count == first.found.runs);
            CHECK(count <= runs);
            if (runs == 70) CHECK(first.found.best.isApprox(Eigen::Vector2d(0.6, 0.3), 0.02));
            CHECK(search_least_squares(asked).found.best == first.found.best);
        }
        std::size_t count = 0;
        const LeastSquares failing = problem(
            [&](const BoxPoint& x) -> Residuals {
                if (++count > 12) throw std::domain_error("stop");
                return holes(x);
            },
            {0.2, 0.2}, 70);
        CHECK_THROWS_AS(search_least_squares(failing), std::domain_error);
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
    for (unsigned seed = 0; seed < 40; ++seed)
        for (const std::size_t runs : {12u, 20u, 60u}) {
            double least = std::numeric_limits<double>::infinity();
            const LeastSquares asked = problem(
                [&, model = rough(seed)](const BoxPoint& x) {
                    const Residuals residuals = model(x);
                    least = std::min(least, residuals->squaredNorm());
                    return residuals;
                },
                {0.45, 0.32}, runs);
            const FitSearch search = search_least_squares(asked);
            const double sum = search.found.residuals.squaredNorm(), noise = std::pow(search.found.noise, 2);
            INFO("seed " << seed << ", " << search.found.runs << " of " << runs << " runs");
            // Three standard deviations of the difference of two sums of three residuals; and what a step
            // gains that is left because it is a twentieth of an error long, with one degree of freedom.
            CHECK(sum <= least + 3.0 * std::sqrt(8.0 * noise * sum + 12.0 * noise * noise) +
                             0.0025 * std::max(noise, sum));
        }
}
