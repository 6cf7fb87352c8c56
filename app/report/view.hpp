#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/results/result.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {

/// One wafer that the page's 3-D view can show.
struct ViewFrame {
    std::string label;             ///< such as "t = 2 s", or a run's number and keys
    std::filesystem::path folder;  ///< folder of the run
    SavedSurface saved;
    std::shared_ptr<const Result> wafer = {};  ///< if not null, shown instead of \p saved
};

/// The section of the 3-D view, and profiles cut from the surfaces before coarsening.
struct View {
    Json section;           ///< type "view": see app/report/viewer.js
    Json profiles;          ///< a chart for each plane
    std::size_t shown = 0;  ///< number of surfaces
};

/// Reads surfaces and interfaces, cuts profiles, and coarsens the meshes until their text fits into \p bytes.
/// Leaves out frames if the coarsest meshes do not fit. Deterministic.
/// \param planes  of the profiles; axis-aligned.
/// \returns a view without frames where nothing fits, with the reason under "note".
/// \throws FileError naming a file that is damaged.
View make_view(std::vector<ViewFrame> frames, const std::vector<surface::Plane>& planes, std::size_t bytes);

/// A unit as a page shows it: "um^3" with the letter mu and a superscript 3, "" for pure numbers.
std::string shown_unit(const std::string& unit);

/// "name [unit]", or the name alone.
std::string with_unit(const std::string& name, const std::string& unit);

/// "name [unit]" for an axis, "name [1]" for pure numbers.
std::string axis_label(const std::string& name, const std::string& unit);

}  // namespace sidewall::app
