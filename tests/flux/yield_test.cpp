#include "flux/yield.hpp"

#include <catch2/catch.hpp>

using namespace sidewall;
using namespace sidewall::flux;

TEST_CASE("the mean yield of a flat wafer is that over the source's angles and energies") {
    // cos^n per solid angle: the mean cosine is (n + 1) / (n + 2).
    const Yield cosine{"y", Angular::cosine, 0.0, {2.0}, {}};
    for (const double n : {0.0, 1.0, 10.0, 1000.0})
        CHECK(mean_yield({"beam", n, {1.0}}, cosine) == Approx(2.0 * (n + 1.0) / (n + 2.0)).epsilon(1e-4));

    // Expectation of sqrt(E) over a narrow normal distribution, to the fourth order of its width.
    Species ion{"ion", 1e9, {0.0}};
    ion.energy = {100.0, 5.0};
    const double width = 0.05 * 0.05, root = 10.0 * (1.0 - width / 8.0 - 15.0 * width * width / 128.0);
    const Yield energetic{"y", Angular::none, 16.0, {1.0}, {}};
    CHECK(mean_yield(ion, energetic) == Approx(root - 4.0).epsilon(1e-6));
    // A tilted narrow beam has the yield of its incidence.
    ion.beam = {0.6, 0.0, -0.8};
    CHECK(mean_yield(ion, {"y", Angular::sputter, 0.0, {1.0}, {9.3}}) ==
          Approx(root * (1.0 + 9.3 * 0.36) * 0.8).epsilon(1e-4));
}
