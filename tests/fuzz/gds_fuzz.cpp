// Damaged layouts: gds_fuzz [SECONDS [SEED]] (mutate.hpp). They are refused with a FileError that names the
// file, or give finite polygons.
#include <cmath>

#include "app/recipe/layout/flatten.hpp"
#include "app/recipe/layout/layout_file.hpp"
#include "surface/error.hpp"
#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/fuzz/mutate.hpp"

using namespace sidewall;
using fuzz::expect;

namespace {

bool attempt(const std::string& bytes) {
    try {
        const app::Layout library = app::parse_layout(bytes, "fuzz.gds");
        std::set<std::string> missing;
        for (const std::string& top : app::top_cells(library))
            for (const auto& [layer, datatype] : {std::pair{1, 0}, std::pair{2, 5}})
                for (const levelset::Polygon& polygon :
                     app::flatten(library, top, layer, datatype, missing)) {
                    expect(polygon.size() >= 3, "a polygon has three corners");
                    for (const auto& [x, y] : polygon)
                        expect(std::isfinite(x) && std::isfinite(y), "corners are finite");
                }
        return true;
    } catch (const FileError& error) {
        expect(std::string(error.what()).starts_with("fuzz.gds: "), "an error names the file");
        return false;
    }
}

}  // namespace

int main(int argc, char** argv) {
    const std::string unit =
        test::gds_cell("UNIT", test::gds_boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0}) +
                                   test::gds_path(2, 5, 20, {0, 0, 200, 0, 200, 50}));
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
    return fuzz::run(argc, argv, seeds, words,
                     [](const std::string& bytes, std::size_t) { return attempt(bytes); });
}
