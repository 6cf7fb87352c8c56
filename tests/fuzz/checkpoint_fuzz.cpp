// Damages the checkpoint of a small run, see mutate.hpp. Kind 0 changes bytes of the file, which its seal
// must detect. Kind 1 changes the run's state under a seal that fits; the reader must refuse it or return a
// valid state. Refusals are FileErrors in printable text that name the file.
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "app/process/wafer.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/layers/checkpoint.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/fuzz/mutate.hpp"

using namespace sidewall;

namespace {

namespace fs = std::filesystem;

constexpr const char* kRecipe = R"([domain]
extent = [2.0, 2.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 1.0
[[step]]
model = "isotropic"
duration = 1.0
rate = 0.1
deposit = "SiO2"
)";

app::RunState seed_state(const app::Recipe& recipe) {
    app::RunState state = app::initial_state(recipe);
    TriangleMesh sheet;
    sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    state.carried.scene = std::make_shared<const surface::RayScene>(sheet);
    state.carried.names = {"flux_neutral", "theta"};
    state.carried.corner = {std::vector<double>(6, 1.0), std::vector<double>(6, 0.5)};
    state.files = {{0.0, 0, "surface_0000.vtp"}};
    state.advance(0.25, 1.0);
    return state;
}

// Whether the checkpoint was read, not refused.
bool read(const fs::path& folder, const app::Recipe& recipe) {
    try {
        const app::RunState state = app::resume_state(folder, recipe);
        for (const auto& values : state.carried.corner)
            for (const double value : values) fuzz::expect(std::isfinite(value), "coverages are finite");
        fuzz::expect(state.time_steps.size() == state.step + 1 && std::isfinite(state.time),
                     "a state is one that a run can be in");
        return true;
    } catch (const FileError& error) {
        const std::string text = error.what();
        fuzz::expect(text.find((folder / "checkpoint.vdb").string()) != std::string::npos,
                     "an error names the file");
        fuzz::expect(text == surface::printable(text), "an error holds characters only");
        return false;
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::string name = (fs::temp_directory_path() / "checkpoint_fuzz_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) return 1;
    const fs::path folder = name, path = folder / "checkpoint.vdb";
    const app::Recipe recipe = app::parse_recipe(kRecipe, "fuzz.toml");
    app::save_state(folder, recipe, seed_state(recipe));
    const std::string whole = surface::read_whole_file(path);
    const levelset::Checkpoint seed = levelset::load_checkpoint(path, app::domain_of(recipe));
    const int code = fuzz::run(argc, argv, {{whole, 0}, {seed.text, 1}}, {},
                               [&](const std::string& bytes, std::size_t kind) {
                                   if (kind == 1) {
                                       levelset::save_checkpoint(path, seed.stack, bytes);
                                       return read(folder, recipe);
                                   }
                                   std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
                                   const bool taken = read(folder, recipe);
                                   fuzz::expect(!taken || bytes == whole, "a damaged file is refused");
                                   return taken;
                               });
    fs::remove_all(folder);
    return code;
}
