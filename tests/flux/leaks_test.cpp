#include "flux/tracer/tracer.hpp"

#include <catch2/catch.hpp>

using sidewall::flux::leaks_too_much;

TEST_CASE(
    "a surface leaks too much three deviations above one particle in 100 000, and above the leaks allowed "
    "besides") {
    CHECK_FALSE(leaks_too_much(0, 1));
    CHECK(leaks_too_much(1, 32));
    CHECK(leaks_too_much(1, 9'000));  // 0.09 + 3 * 0.3
    CHECK_FALSE(leaks_too_much(1, 9'300));
    CHECK_FALSE(leaks_too_much(4, 100'000));  // 1 + 3 * 1
    CHECK(leaks_too_much(5, 100'000));
    CHECK_FALSE(leaks_too_much(130, 10'000'000));  // 100 + 3 * 10
    CHECK(leaks_too_much(131, 10'000'000));
    CHECK_FALSE(leaks_too_much(10, 1000, 10.0));
    CHECK(leaks_too_much(11, 1000, 10.0));
    CHECK_FALSE(leaks_too_much(14, 100'000, 10.0));
    CHECK(leaks_too_much(15, 100'000, 10.0));
}
