#include "app/evaluation/compare.hpp"

#include <catch2/catch.hpp>

#include "app/common/json.hpp"

using namespace sidewall::app;

namespace {

Json variant(const char* method, double total, double simplify, double trace, int triangles, double error,
             double flux_seconds) {
    return Json{{"method", method},
                {"timing", {{"features", 0.0}, {"simplify", simplify}, {"trace", trace}, {"total", total}}},
                {"mesh", {{"simplified", {{"triangles", triangles}}}}},
                {"relative_error", error},
                {"flux_seconds_at_equal_error", flux_seconds}};
}

std::string verdict(const Json& raw, const Json& one, const Json& other) {
    return compare_verdict({{"variants", Json::array({raw, one, other})}});
}

}  // namespace

TEST_CASE("a comparison ends with a sentence that says whether simplification paid, by how much and why") {
    const Json raw = variant("none", 7.23, 0.0, 5.98, 60000, 0.02, 5.98),
               nothing_saved = variant("region", 9.0, 2.0, 6.0, 50000, 0.02, 8.0);
    // The whole run is slower, the flux at an equal error 3.6 times faster.
    CHECK(
        verdict(raw, variant("region-bounded", 8.26, 0.9, 5.5, 4000, 0.0075, 1.64), nothing_saved) ==
        "Simplification paid: for the flux at an equal error of 2 % region-bounded takes 1.64 s and the raw run 5.98 s, "
        "3.6 times as long, because 4000 of 60000 triangles are left, which need 14.1 % of the rays, and simplifying "
        "takes 0.9 s; with equal rays, as here, the whole run takes 8.26 s and the raw one 7.23 s: there it gains "
        "accuracy, not time.");
    const std::string faster = verdict(raw, variant("region", 5.0, 0.1, 3.0, 4000, 0.01, 0.9), nothing_saved);
    CHECK_THAT(faster, Catch::StartsWith("Simplification paid: ") && Catch::EndsWith("raw one 7.23 s."));
    // The better of the two is still slower than the raw run: 6.6 s against 5.98 s.
    const std::string slower =
        verdict(raw, variant("region-bounded", 8.0, 1.6, 5.0, 55000, 0.02, 6.6), nothing_saved);
    CHECK_THAT(
        slower,
        Catch::StartsWith("Simplification did not pay: ") &&
            Catch::Contains("region-bounded takes 6.6 s and the raw run 5.98 s, 1.1 times less, because") &&
            Catch::Contains("need 100 % of the rays"));
    CHECK_THAT(verdict(raw, variant("region", 7.2, 0.1, 5.9, 59000, 0.02, 6.0), nothing_saved),
               Catch::StartsWith("Simplification made no difference: "));
}

TEST_CASE("runs that take the rays they need for an accuracy are not said to have equal ones") {
    Json raw = variant("none", 1.02, 0.0, 0.9, 2900, 0.05, 0.9),
         one = variant("auto", 0.47, 0.1, 0.3, 500, 0.05, 0.3);
    raw["rays"] = 120'000.0, one["rays"] = 18'000.0;
    CHECK_THAT(verdict(raw, one, one),
               Catch::Contains("which need 15 % of the rays") &&
                   Catch::Contains("with 15 % of the raw run's rays, as here, the whole run"));
}

TEST_CASE("a comparison without an error has equal rays, and one without a traced flux nothing to save") {
    const Json exact = variant("none", 2.0, 0.0, 1.0, 1000, 0.0, 1.0);
    CHECK_THAT(compare_verdict({{"variants", {exact, variant("region", 1.5, 0.1, 0.3, 100, 0.0, 0.4)}}}),
               Catch::StartsWith("Simplification paid: for the flux with equal rays region takes 0.4 s") &&
                   Catch::Contains("need 100 % of the rays"));
    const Json none = variant("none", 1.0, 0.0, 0.0, 1000, 0.0, 0.0);
    CHECK(compare_verdict({{"variants", {none, none}}}) ==
          "No flux was traced, so that simplification had nothing to save.");
}
