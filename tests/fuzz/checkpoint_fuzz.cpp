// Damages the checkpoint of a small run in ever new ways and reads it, for a time:
//   checkpoint_fuzz [SECONDS [SEED]]
// Two kinds: bytes of the file changed, which the seal must notice; and the run's state changed under a seal
// that fits, which the reader must refuse or make a sound state of. Refusals are FileErrors in printable text
// that name the file; anything else ends the program with a failure and leaves the file where the message
// says.
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "app/process/state.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/checkpoint.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"

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

using Random = std::mt19937_64;

// A few changes: bits, bytes, numbers of four bytes, and pieces cut out, repeated or filled.
std::string damaged(std::string bytes, Random& random) {
    for (std::uint64_t left = 1 + random() % 4; left > 0 && !bytes.empty(); --left) {
        const std::size_t at = random() % bytes.size();
        const std::size_t length = 1 + random() % std::min<std::size_t>(bytes.size() - at, 64);
        switch (random() % 7) {
            case 0:
                bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
                break;
            case 1:
                bytes[at] = static_cast<char>(random());
                break;
            case 2:  // a size or a count, often a vast one
                for (std::size_t k = 0; k < std::min<std::size_t>(4, bytes.size() - at); ++k)
                    bytes[at + k] = random() % 2 == 0 ? '\xff' : static_cast<char>(random());
                break;
            case 3:
                bytes.erase(at, length);
                break;
            case 4:
                bytes.insert(at, bytes.substr(at, length));
                break;
            case 5:
                std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length, '\0');
                break;
            default:
                bytes.resize(at);
        }
    }
    return bytes;
}

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

[[noreturn]] void broken(const char* promise, const fs::path& path) {
    std::fprintf(stderr, "broken promise: %s: see %s\n", promise, path.c_str());
    std::exit(1);
}

void read(const fs::path& folder, const app::Recipe& recipe, bool refused) {
    const fs::path path = folder / "checkpoint.vdb";
    const auto start = std::chrono::steady_clock::now();
    try {
        const app::RunState state = app::resume_state(folder, recipe);
        if (refused) broken("a damaged file is refused", path);
        for (const auto& values : state.carried.corner)
            for (const double value : values)
                if (!std::isfinite(value)) broken("coverages are finite", path);
        if (state.time_steps.size() != state.step + 1 || !std::isfinite(state.time))
            broken("a state is one that a run can be in", path);
    } catch (const FileError& error) {
        const std::string text = error.what();
        if (text.find(path.string()) == std::string::npos) broken("an error names the file", path);
        if (!std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; }))
            broken("an error is printable", path);
    } catch (const std::exception& error) {
        broken(error.what(), path);
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (seconds.count() > 5.0) broken("a damaged file is refused at once", path);
}

}  // namespace

int main(int argc, char** argv) {
    const double seconds = argc > 1 ? std::atof(argv[1]) : 10.0;
    Random random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
    std::string name = (fs::temp_directory_path() / "checkpoint_fuzz_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) return 1;
    const fs::path folder = name, path = folder / "checkpoint.vdb";

    const app::Recipe recipe = app::parse_recipe(kRecipe, "fuzz.toml");
    app::save_state(folder, recipe, seed_state(recipe));
    const std::string whole = surface::read_whole_file(path);
    const levelset::Checkpoint seed = levelset::load_checkpoint(path, app::domain_of(recipe));

    std::uint64_t files = 0, states = 0;
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds) {
        for (int k = 0; k < 20; ++k) {  // sealing one takes as long as many of these
            const std::string bytes = damaged(whole, random);
            if (bytes == whole) continue;
            std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
            read(folder, recipe, true);
            ++files;
        }
        levelset::save_checkpoint(path, seed.stack, damaged(seed.text, random));
        read(folder, recipe, false);
        ++states;
    }
    fs::remove_all(folder);
    std::printf("%llu damaged files, %llu damaged states: nothing found\n",
                static_cast<unsigned long long>(files), static_cast<unsigned long long>(states));
    return 0;
}
