#include "app/common/console.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "app/common/json.hpp"

using namespace sidewall::app;

TEST_CASE("where no terminal shows a bar, a line is due every minute and at every tenth") {
    LineTimer run(0.0, true);
    CHECK_FALSE(run.due(0.0, 0.0));
    CHECK_FALSE(run.due(0.09, 3.0));
    CHECK(run.due(0.1, 4.0));
    CHECK_FALSE(run.due(0.1, 5.0));
    CHECK(run.due(0.35, 6.0));  // two tenths at once make one line
    CHECK_FALSE(run.due(0.36, 65.0));
    CHECK(run.due(0.36, 66.0));
    CHECK_FALSE(run.due(0.36, 67.0));
    CHECK(run.due(1.0, 70.0));
    CHECK_FALSE(run.due(1.0, 71.0));
    LineTimer resumed(0.52, true);
    CHECK_FALSE(resumed.due(0.55, 1.0));
    CHECK(resumed.due(0.6, 2.0));
    LineTimer minutes(0.0, false);
    CHECK_FALSE(minutes.due(0.9, 59.0));
    CHECK(minutes.due(0.9, 60.0));
}

TEST_CASE("a number is written with the digits it deserves") {
    CHECK(number_or_null(0.30000000000000004, 9).dump() == "0.3");
    CHECK(number_or_null(123.456789, 6).dump() == "123.457");
    CHECK(number_or_null(1.0 / 3.0) == 1.0 / 3.0);  // all digits by default
    CHECK(number_or_null(5e-324, 6).is_number());
    CHECK(number_or_null(-0.0, 6) == 0.0);
    CHECK(number_or_null(std::numeric_limits<double>::quiet_NaN(), 6).is_null());
}
