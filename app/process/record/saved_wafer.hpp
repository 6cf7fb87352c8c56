#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "app/process/state.hpp"
#include "app/results/metrology.hpp"
#include "app/results/result.hpp"

// Wafers of a run's folder, to be drawn and measured.
namespace sidewall::app {

/// The wafer of a folder's checkpoint as a result: surface and interfaces with their materials.
/// \returns nothing if there is no checkpoint, or a surface of its time or a later one has been saved.
/// \throws FileError, RecipeError if it is damaged, or the recipe beside it.
std::optional<Result> wafer_of_checkpoint(const std::filesystem::path& folder);

/// Measures one of the wafers that a folder's run has saved, or that of its checkpoint.
/// \param recipe  whose [metrology] says what is measured; of the folder (load_frame).
/// \param saved   of the folder's surfaces; none: the checkpoint's wafer, which is that of the end of a finished run.
/// \param anew    measure what the recipe says; else give the figures that the run found where it ended a step.
/// \note A saved wafer is made anew from its surface and interfaces, which rounds sharp edges within their cell.
/// \throws FileError if the checkpoint is missing or damaged.
std::vector<Measure> measure_saved(const std::filesystem::path& folder, const Recipe& recipe,
                                   const std::optional<SavedSurface>& saved, bool anew);

}  // namespace sidewall::app
