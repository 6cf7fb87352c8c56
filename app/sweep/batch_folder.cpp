#include "app/sweep/batch_folder.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "app/common/json.hpp"
#include "app/process/record/manifest.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Names of the entries in which two plans differ.
std::string differing(const Json& now, const Json& there) {
    std::string names;
    for (const auto& [name, value] : now.items())
        if (name != "digest" && there.value(name, Json()) != value)
            names += (names.empty() ? "" : ", ") + name;
    return names.empty() ? "the recipe" : names;
}

}  // namespace

void open_batch_folder(const std::filesystem::path& folder, const std::string& file, const std::string& what,
                       const Json& plan, bool resume) {
    std::error_code failure;
    remove_partial_files(folder, {file, std::filesystem::path(file).replace_extension("csv").string()});
    if (!std::filesystem::exists(folder / file, failure)) {
        for (const char* other : {"sweep.json", "fit.json", "runs", "manifest.txt", "compare.json"})
            if (std::filesystem::exists(folder / other, failure))
                throw RecipeError(fmt::format("{}: holds other results ({}): choose another folder with -o",
                                              folder.string(), other));
        return;
    }
    const Json there = read_json(folder / file, fmt::format("choose another folder with -o"));
    if (!there.is_object() || there.value("digest", Json()) != plan["digest"])
        throw RecipeError(
            fmt::format("{}: holds another {}, which differs in {}: choose another folder with -o",
                        folder.string(), what, there.is_object() ? differing(plan, there) : file));
    if (!resume)
        throw RecipeError(
            fmt::format("{}: holds this {} already: go on with --resume, or choose another folder with -o",
                        folder.string(), what));
}

}  // namespace sidewall::app
