#pragma once
#include "app/common/json_fwd.hpp"
#include "app/study/fit_targets.hpp"
#include "app/study/least_squares.hpp"
#include "app/study/vary.hpp"

namespace sidewall::app {

/// A fit's end: its parameters, and the run that came closest.
struct FitEnd {
    const std::vector<Vary>& varied;
    const FitTargets& targets;
    const LeastSquaresResult& found;
    const Recipe& best_recipe;
    const SetRun& best_run;
    std::size_t best_number = 0;
    std::filesystem::path best_folder, first_folder;  ///< the first run's: where the fit began
};

/// What fit.json says of it.
Json fit_json(const FitEnd& end);

/// The measured profile \p profile over the contours of the first and the best run, as SVG.
std::string overlay_svg(const FitEnd& end, std::size_t profile);

}  // namespace sidewall::app
