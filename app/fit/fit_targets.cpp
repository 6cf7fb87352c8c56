#include "app/fit/fit_targets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/common/text.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/results/result.hpp"
#include "app/schema/keys.hpp"

namespace sidewall::app {
namespace {

MeasureTarget read_target(const std::string& text) {
    constexpr const char* kForm = "write NAME=VALUE or NAME=VALUE+-SIGMA, e.g. depth=2.1+-0.05";
    const std::size_t equals = text.rfind('='), error = text.rfind("+-");
    if (equals == std::string::npos || equals == 0) throw RecipeError("--target {}: {}", text, kForm);
    MeasureTarget target{.name = text.substr(0, equals)};
    const std::string_view values = std::string_view(text).substr(equals + 1);
    const std::size_t split = error == std::string::npos ? values.size() : error - equals - 1;
    const auto asked = finite_number(values.substr(0, split));
    if (split < values.size()) {
        target.sigma = finite_number(values.substr(split + 2));
        if (!target.sigma || *target.sigma <= 0.0)
            throw RecipeError("--target {}: SIGMA must be greater than 0: {}", text, kForm);
    }
    if (!asked) throw RecipeError("--target {}: VALUE is no number: {}", text, kForm);
    target.asked = *asked;
    return target;
}

}  // namespace

FitTargets read_targets(const FitOptions& options, const Recipe& recipe) {
    FitTargets targets{.profile_sigma = options.profile_sigma,
                       .offset = {.x = options.profile_offset.find('x') != std::string::npos,
                                  .z = options.profile_offset.find('z') != std::string::npos}};
    std::size_t known = 0;
    for (const std::string& text : options.targets) {
        MeasureTarget target = read_target(text);
        Recipe asked = recipe;
        want_figure(asked, target.name, "--target", text);
        for (const MeasureTarget& other : targets.measures)
            if (other.name == target.name)
                throw RecipeError("--target {}: {} is asked for twice", text, target.name);
        known += target.sigma ? 1 : 0;
        targets.measures.push_back(std::move(target));
    }
    if (options.profile_sigma && *options.profile_sigma <= 0.0)
        throw RecipeError("--profile-sigma: must be greater than 0");
    for (const std::string& name : options.profiles) {
        targets.profiles.push_back(read_measured_profile(name, recipe.domain.length_unit));
        require_saved_time(targets.profiles.back(), recipe);
        require_wafer_size(targets.profiles.back(), recipe);
        known += options.profile_sigma ? 1 : 0;
    }
    const std::size_t all = targets.measures.size() + targets.profiles.size();
    if (all == 0)
        throw RecipeError(
            "--target: missing: say what to fit, e.g. --target depth=2.1+-0.05, or --target-profile");
    if (known != 0 && known != all)
        throw RecipeError(
            "--target: some have a standard deviation and some have none, so that their weights are unknown: "
            "give all of them one (+-SIGMA, --profile-sigma) or none");
    targets.known_errors = known > 0;
    return targets;
}

double scale_of(const MeasureTarget& target) {
    return target.sigma.value_or(target.asked != 0.0 ? std::abs(target.asked) : 1.0);
}

double profile_scale(const FitTargets& targets, std::size_t profile) {
    return targets.profile_sigma.value_or(
        std::max(bounds_of(targets.profiles[profile].points).sizes().maxCoeff(), 1e-300));
}

void want_targets(const FitTargets& targets, Recipe& recipe) {
    for (const MeasureTarget& target : targets.measures) want_measure(recipe, target.name, "--target");
}

std::optional<ProfileResidual> profile_residual(const FitTargets& targets, std::size_t profile,
                                                const Recipe& recipe, const std::filesystem::path& folder) {
    const MeasuredProfile& measured = targets.profiles[profile];
    ProfileResidual residual{.contour = contour_of(folder, recipe, measured.time)};
    auto distance = distance_to(residual.contour, measured.points, targets.offset);
    if (!distance) return std::nullopt;
    residual.distance = std::move(*distance);
    return residual;
}

std::optional<Eigen::VectorXd> residuals_of(const FitTargets& targets, const Recipe& recipe,
                                            const SetRun& run, const std::filesystem::path& folder,
                                            std::string& missing) {
    std::vector<double> all;
    for (const MeasureTarget& target : targets.measures) {
        const double got = figure_of(run.summary, target.name);
        if (std::isnan(got)) {
            missing = target.name;
            return std::nullopt;
        }
        all.push_back((got - target.asked) / scale_of(target));
    }
    for (std::size_t k = 0; k < targets.profiles.size(); ++k) {
        const auto found = profile_residual(targets, k, recipe, folder);
        if (!found) {
            missing = targets.profiles[k].name;
            return std::nullopt;
        }
        for (const double distance : found->distance.signed_distances)
            all.push_back(distance / profile_scale(targets, k));
    }
    return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

std::vector<std::string> labels_of(const std::vector<std::string>& files) {
    if (files.size() == 1) return {""};
    std::vector<std::string> labels;
    for (const std::string& file : files) {
        labels.push_back(std::filesystem::path(file).stem().string());
        if (std::count(labels.begin(), labels.end(), labels.back()) > 1)
            throw RecipeError(
                "{}: two recipes are called {}: their targets could not be told apart: "
                "rename one",
                file, labels.back());
    }
    return labels;
}

std::vector<std::string> own_texts(const std::vector<std::string>& texts,
                                   const std::vector<std::string>& labels, const std::string& label) {
    std::vector<std::string> chosen;
    for (const std::string& text : texts) {
        const auto before = std::find_if(labels.begin(), labels.end(), [&](const std::string& any) {
            return !any.empty() && text.starts_with(any + ":");
        });
        if (before == labels.end())
            chosen.push_back(text);
        else if (*before == label)
            chosen.push_back(text.substr(label.size() + 1));
    }
    return chosen;
}

void require_labels(const char* option, const std::vector<std::string>& texts,
                    const std::vector<std::string>& labels) {
    for (const std::string& text : texts)
        for (const std::string& label : labels) {
            const std::size_t colon = text.find(':');
            const std::string before = text.substr(0, colon);
            if (label.empty() || std::find(labels.begin(), labels.end(), before) != labels.end()) break;
            throw RecipeError("{} {}: does not say of which recipe: write {}:{}{}", option, text, label,
                              colon == std::string::npos ? text : text.substr(colon + 1),
                              colon == std::string::npos ? "" : did_you_mean(": ", before, labels, ""));
        }
}

}  // namespace sidewall::app
