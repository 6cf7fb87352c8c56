#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "app/pictures/render.hpp"

namespace sidewall::app {

/// Name of a surface with its time: "surface_0003.vtp, time 48 s".
std::string name_and_time(const Result& result);

/// Draws every surface that a run saved, all on one scale: FOLDER/surface_NNNN.png for surface_NNNN.vtp, and
/// FOLDER/strip.png with all of them, shrunk, row by row with their times. FOLDER/pictures.txt lists the
/// files; pictures of an earlier list that are not redrawn are removed.
///
/// \param done  receives a line for every picture once it is written.
/// \throws FileError if \p run is not the folder of a run, RecipeError as render() or if no surface has the
///         attribute, IoError.
void render_all(const std::filesystem::path& run, const RenderOptions& options,
                const std::filesystem::path& output, const std::function<void(const std::string&)>& done);

}  // namespace sidewall::app
