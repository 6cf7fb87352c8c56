#include "flux/leaks.hpp"

#include <catch2/catch.hpp>

using sidewall::flux::leaks_too_much;

TEST_CASE("a surface leaks too much above one particle in 100 000, and above the leaks allowed besides") {
    CHECK_FALSE(leaks_too_much(0, 1));
    CHECK(leaks_too_much(1, 99'999));
    CHECK_FALSE(leaks_too_much(1, 100'000));
    CHECK_FALSE(leaks_too_much(3, 300'000));
    CHECK(leaks_too_much(4, 300'000));
    CHECK_FALSE(leaks_too_much(10, 1000, 10.0));
    CHECK(leaks_too_much(11, 1000, 10.0));
    CHECK_FALSE(leaks_too_much(13, 300'000, 10.0));
    CHECK(leaks_too_much(14, 300'000, 10.0));
}
