#pragma once
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "app/process/simulation.hpp"
#include "levelset/grid.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"

// The surfaces that `sidewall study` evaluates: a low fin, about 71 000 vertices, and a contact hole of
// aspect ratio 10, about 175 000.
namespace sidewall::bench {

struct StudySurface {
    std::string name;
    TriangleMesh mesh;
    double spacing = 0.0;  ///< spacing of the grid it was extracted from
};

/// Grows both from their recipes, in about a minute.
inline std::vector<StudySurface> study_surfaces() {
    const std::filesystem::path recipes = std::filesystem::path(SIDEWALL_SOURCE_DIR) / "configs/study";
    std::vector<StudySurface> surfaces;
    for (const auto& [name, file] : {std::pair{"fin", "surface1.toml"}, {"hole", "surface2.toml"}}) {
        const auto output = std::filesystem::temp_directory_path() / fmt::format("sidewall_bench_{}", name);
        const app::RunResult run =
            app::run_recipe(app::load_recipe(recipes / file),
                            {.output = output, .quiet = false, .title = fmt::format("growing the {}", name)});
        surfaces.push_back({name, run.surface, run.summary["grid_spacing"].get<double>()});
        std::filesystem::remove_all(output);
    }
    return surfaces;
}

/// The surfaces named MESH=GRID_SPACING, or the study's if none is named. Attributes are dropped, as in the
/// study: simplification would leave the borders of materials untouched.
/// \throws RecipeError for another word.
inline std::vector<StudySurface> surfaces_of(const std::vector<std::string>& words) {
    std::vector<StudySurface> surfaces;
    for (const std::string& word : words) {
        const auto equals = word.rfind('=');
        const double spacing = equals == std::string::npos ? 0.0 : std::atof(word.substr(equals + 1).c_str());
        if (!(spacing > 0.0)) throw RecipeError(fmt::format("'{}': give MESH=GRID_SPACING", word));
        const std::string file = word.substr(0, equals);
        surfaces.push_back({std::filesystem::path(file).stem(), surface::read_mesh(file), spacing});
        surfaces.back().mesh.triangle_attributes.clear();
        surfaces.back().mesh.vertex_attributes.clear();
    }
    return words.empty() ? study_surfaces() : surfaces;
}

/// Runs a benchmark's main: output is line-buffered, also into pipes, and errors end it with a message.
template <class Body>
int run_bench(const char* name, Body&& body) try {
    levelset::initialize();
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    body();
    return 0;
} catch (const Error& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return error.exit_code();
}

}  // namespace sidewall::bench
