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

/// One state that the page's 3-D view can show.
struct ViewFrame {
    std::string label;             ///< e.g. "t = 2 s", or a run's number and keys
    std::filesystem::path folder;  ///< of the run
    SavedSurface saved;
    std::shared_ptr<const Result> wafer = {};  ///< shown instead of a saved one, if there is any
};

/// The 3-D view's section, and profiles of the surfaces as saved.
struct View {
    Json section;           ///< type "view": see app/report/viewer.js
    Json profiles;          ///< a chart for each plane
    std::size_t shown = 0;  ///< surfaces
};

/// Reads surfaces and interfaces, cuts them by planes, and coarsens them until their text fits into \p bytes.
/// Deterministic.
/// \param planes  of the profiles; axis-aligned.
/// \returns a view without frames where nothing fits, with the reason under "note".
/// \throws FileError naming a file that is damaged.
View make_view(std::vector<ViewFrame> frames, const std::vector<surface::Plane>& planes, std::size_t bytes);

/// A unit as a page shows it: "um^3" with the letter mu and a raised 3, "" for pure numbers.
std::string shown_unit(const std::string& unit);

/// "name [unit]", or the name alone.
std::string with_unit(const std::string& name, const std::string& unit);

/// "name [unit]" for an axis, "name [1]" without a dimension.
std::string axis_label(const std::string& name, const std::string& unit);

}  // namespace sidewall::app
