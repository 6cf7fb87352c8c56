#include "app/common/text.hpp"

#include <catch2/catch.hpp>

#include "app/schema/units.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

using Columns = std::vector<std::vector<double>>;

CsvTable parsed(const std::string& text) {
    return parse_csv(text, "t.csv");
}

Columns numbers(const CsvTable& table) {
    Columns all;
    for (const CsvColumn& column : table.columns) all.push_back(numbers_of(column));
    return all;
}

}  // namespace

TEST_CASE("a table's first row counts whatever marks, minus signs and delimiters it has", "[foreign]") {
    const Columns valley{{-2, -1, 1, 2}, {1, 0, 0, 1}};
    for (const char* text :
         {"-2,1\n-1,0\n1,0\n2,1\n",                      // plain,
          "\xef\xbb\xbf-2,1\r\n-1,0\r\n1,0\r\n2,1\r\n",  // with a byte order mark,
          "\xe2\x88\x92"
          "2,1\n\xe2\x80\x93"
          "1,0\n1,0\n+2,1",                           // minus and dash of Unicode,
          "sep=,\r\n-2,1\r\n-1,0\r\n1,0\r\n2,1\r\n",  // with Excel's sep= line,
          "\xef\xbb\xbf\"SEP=;\"\n-2;1,0\n-1;0\n1;0\n2;1\n", "sep=\t\n-2\t1\n-1\t0\n1\t0\n2\t1\n",
          "-2;1\n-1;0\n1;0\n2;1\n", "-2\t1\n-1\t0\n1\t0\n2\t1\n",  // other delimiters,
          "  -2  1\n-1 0 \n1\t0\n\n# the end\n2 1\n",              // blanks,
          "\"-2\",\"1\"\n\"-1\",\"0\"\n1,0 # here\n\"2\",1",       // quotes,
          "-2,1\r-1,0\r1,0\r2,1\r",                                // carriage returns,
          "\xc2\xa0-2; 1,0\n-1,0;0\n1;0\n2;1,0e0\n",               // decimal commas
          "-2.0e0\t1\n-.1e1\t0\n1\t0\n2\t1.\n"}) {
        INFO(text);
        CHECK(numbers(parsed(text)) == valley);
        CHECK_FALSE(parsed(text).headed);
    }
    CHECK(numbers(parsed("-0,5;1\n2;1,25\n")) == Columns{{-0.5, 2.0}, {1.0, 1.25}});
    CHECK(numbers(parsed("1,500\t2\n3,25\t4\n")) == Columns{{1.5, 3.25}, {2, 4}});
    CHECK(numbers(parsed("1e3,2e3\n1,2\n")) == Columns{{1000, 1}, {2000, 2}});
}

TEST_CASE("headings are read with their units, and text columns only if somebody wants them", "[foreign]") {
    const CsvTable table = parsed("\"x [nm]\";rate (um/min); where\n1500;0,25;left, upper\n-2e3;3;right\n");
    REQUIRE(table.columns.size() == 3);
    CHECK(table.headed);
    CHECK(table.columns[0].name == "x");
    CHECK(table.columns[0].unit == "nm");
    CHECK(table.columns[1].name == "rate");
    CHECK(table.columns[1].unit == "um/min");
    CHECK(table.columns[2].name == "where");
    CHECK(numbers_of(table.columns[0]) == std::vector<double>{1500, -2000});
    CHECK(numbers_of(table.columns[1]) == std::vector<double>{0.25, 3});
    CHECK_THROWS_WITH(numbers_of(table.columns[2]),
                      "t.csv:2: \"left, upper\" in where is not a finite number");
    CHECK(table.understood ==
          "2 rows of 3 between semicolons, decimal commas, headings x [nm], rate [um/min], where");
    CHECK(parsed("sep=;\nx;a,b\n0;1,5\n").columns[1].name == "a,b");
    CHECK_THROWS_AS(parsed("sep=;\nsep=;\n"), FileError);
    CHECK(parsed(",x\n0,1\n").columns[0].name.empty());  // an index without a name
}

TEST_CASE("lengths, times and rates of a table become the recipe's", "[foreign]") {
    CsvTable table = parsed("x [nm],v [nm/min],t [h],E [eV],y [\xc2\xb5m]\n1500,6,2,7,3\n");
    convert_columns(table, {.length = "um", .time = "s"});
    const double expected[] = {1.5, 1e-4, 7200, 7, 3};
    for (std::size_t k = 0; k < 5; ++k)
        CHECK(table.columns[k].values[0] == Approx(expected[k]).epsilon(1e-14));
    CHECK_THAT(table.understood, Contains("converted to the recipe's um and s"));
    CHECK(size_in({.length = "nm", .time = "min"}, "um/s") == Approx(60000.0).epsilon(1e-14));
    CHECK(size_in({.length = "nm"}, "\xc3\x85") == Approx(0.1).epsilon(1e-14));
    for (const char* other : {"", "K", "1/s", "nm/", "/s", "um/um", "nm/min/s"})
        CHECK_FALSE(size_in({}, other));
}

TEST_CASE("a number followed by anything is refused in every column, by line", "[foreign]") {
    const std::pair<const char*, const char*> bad[] = {
        {"1,2\n3,4um\n", "t.csv:2: \"4um\" in column 2"},
        {"1,2,3\n4,5,6.0D+01\n", "t.csv:2: \"6.0D+01\" in column 3"},
        {"1;2\n3;1,5,2\n", "t.csv:2: \"1,5,2\""},
        {"1;2\n3;1.234,5\n", "t.csv:2: \"1.234,5\""},
        {"1;2,5\n3;1.5\n", "decimal points and decimal commas"},
        {"1,5 2,5\n", "t.csv:1: \"5 2\" in column 2"},
        {"1,\"2,5\"\n", "t.csv:1: \"2,5\""},
        {"nan,nan\n1,2\n", "t.csv:1: \"nan\""},
        {"-INF,1\n1,2\n", "t.csv:1: \"-INF\""},
        {"1.5um,2um\n1,2\n", "t.csv:1: \"1.5um\""},
        {"x,1\n1,2\n", "t.csv:1: \"x\" in column 1"},
        {"1,2\n3\n", "t.csv:2: 1 values in a table of 2 columns"},
        {"1,2\n3,4,\n", "t.csv:2: 3 values in a table of 2 columns"},
        {"1,2\n3,\n", "t.csv:2: \"\" in column 2"},
        {"1,+-2\n", "t.csv:1: \"+-2\""},
        {"1,0x10\n", "t.csv:1: \"0x10\""},
        {"1,1e999\n", "t.csv:1: \"1e999\""},
        {"x,z\n", "holds no row of numbers"},
        {"", "holds no row of numbers"},
        {"\xff\xfe\x31\x00\x2c\x00", "UTF-16"},
    };
    for (const auto& [text, message] : bad) {
        INFO(text);
        CHECK_THROWS_WITH(parsed(text), Contains(message) && Contains("t.csv:"));
    }
    CHECK_THROWS_WITH(parse_csv("1,2\n3,4\n5,6\n", "t.csv", 2), Contains("t.csv:3: over 2 rows"));
    CHECK_THROWS_WITH(parsed(std::string(2000, ',') + "1\n"), Contains("over 1000 columns"));
    CHECK_THROWS_AS(parsed(std::string("1,\0\x1b]0\n", 7)), FileError);
}
