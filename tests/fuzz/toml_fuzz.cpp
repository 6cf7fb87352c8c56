// Damaged recipes: toml_fuzz [SECONDS [SEED]] (mutate.hpp). The reader refuses them with an error that names
// the file, or the effective recipe written from them reads back unchanged.
#include <filesystem>

#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/recipe.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/fuzz/mutate.hpp"

using namespace sidewall;
using fuzz::expect;

namespace {

namespace fs = std::filesystem;
const fs::path kFolder = SIDEWALL_SOURCE_DIR "/configs/quick";

bool attempt(const std::string& text) {
    const std::string file = (kFolder / "fuzz.toml").string();
    app::Recipe recipe;
    try {
        recipe = app::parse_recipe(text, file);
    } catch (const RecipeError& error) {
        expect(std::string(error.what()).starts_with(file + ":"),
               std::string("an error names the file and the line: ") + error.what());
        return false;
    } catch (const FileError&) {  // names the layout or mesh that the recipe refers to
        return false;
    }
    const std::string effective = app::effective_recipe(recipe);
    try {
        expect(app::effective_recipe(app::parse_recipe(effective, file)) == effective,
               "the effective recipe reads back as the same");
    } catch (const Error& error) {
        expect(false, std::string("the effective recipe can be read: ") + error.what());
    }
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(kFolder))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    std::sort(files.begin(), files.end());  // the same order, and so the same rounds, on every machine
    std::vector<fuzz::Seed> seeds;
    for (const fs::path& file : files) seeds.push_back({surface::read_whole_file(file)});
    const std::vector<std::string> words{"nan",
                                         "inf",
                                         "-1",
                                         "0",
                                         "1e308",
                                         "1e-320",
                                         "9223372036854775807",
                                         "true",
                                         "\"\"",
                                         "\"auto\"",
                                         "[]",
                                         "[[",
                                         "]]",
                                         "{",
                                         "}",
                                         "=",
                                         ".",
                                         "\n",
                                         "#",
                                         "'''",
                                         "\"\"\"",
                                         "\\u0000",
                                         "\xff",
                                         "[domain]\n",
                                         "[[layer]]\n",
                                         "[[step]]\n",
                                         "[[step.steps]]\n",
                                         "repeat = 100000\n",
                                         "grid_spacing = 1e-9\n",
                                         "a.b.c.d = 1\n",
                                         "shape = \"mask\"\n",
                                         "shape = \"stack\"\n",
                                         "shape = \"mesh\"\n",
                                         "file = \"/\"\n",
                                         "polygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n"};
    return fuzz::run(argc, argv, seeds, words,
                     [](const std::string& text, std::size_t) { return attempt(text); });
}
