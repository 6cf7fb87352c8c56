#pragma once
#include <filesystem>

#include "app/report/parts.hpp"

namespace sidewall::app {

/// The page of a study's folder: its verdicts, and charts in the place of Figures 8.8 to 8.13 of Lenz (2023).
Page study_page(const std::filesystem::path& folder);

}  // namespace sidewall::app
