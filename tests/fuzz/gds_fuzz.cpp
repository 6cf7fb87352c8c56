// Damaged GDSII layouts: gds_fuzz [SECONDS [SEED]] (mutate.hpp). The reader refuses them with a FileError
// that names the file, or returns finite polygons.
#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/fuzz/layout_attempt.hpp"

using namespace sidewall;

int main(int argc, char** argv) {
    const std::string unit =
        test::gds_cell("UNIT", test::gds_boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0}) +
                                   test::gds_path(2, 5, 20, {0, 0, 200, 0, 200, 50, 180, 45, 5, 40}));
    const std::string array = test::gds_array("UNIT", 3, 2, {0, 0, 900, 0, 0, 800}),
                      turned = test::gds_reference("UNIT", {5000, 0}, true, 2.0, 90.0);
    const std::vector<fuzz::Seed> seeds{
        {test::gds_library(unit + test::gds_cell("TOP", array + turned))},
        {test::gds_library(unit + test::gds_cell("A", array) +
                           test::gds_cell("B", test::gds_reference("A", {0, 0})) +
                           test::gds_cell("TOP", test::gds_array("B", 9, 9, {0, 0, 9, 0, 0, 9})))}};
    const std::vector<std::string> words{unit,
                                         array,
                                         turned,
                                         test::gds_end(),
                                         test::gds_short(0x13, {32767, 32767}),
                                         test::gds_put(0x1b, 5, test::gds_real(1e70)),
                                         test::gds_reference("TOP", {0, 0}),
                                         test::gds_short(0x0d, {1}),
                                         test::gds_put(0x07, 0),
                                         test::gds_put(0x04, 0)};
    return fuzz::run(argc, argv, seeds, words, [](const std::string& bytes, std::size_t) {
        return fuzz::attempt_layout(bytes, "fuzz.gds", {{1, 0}, {2, 5}});
    });
}
