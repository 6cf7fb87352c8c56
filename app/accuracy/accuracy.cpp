#include "app/accuracy/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/models/model.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/record/manifest.hpp"
#include "app/process/record/run_folder.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/results/result.hpp"
#include "app/sweep/sweep.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Coarsest and finest grid, over the recipe's grid spacing.
constexpr double kCoarsest = 4.0, kFinest = 0.25;
// Ratio of one grid spacing to the next: a smaller one would cost as much again for little.
constexpr double kLeastRatio = 1.4, kMostRatio = 2.0;
// Share of the accuracy asked for that each bar may take; the squares add up to 1.
constexpr double kGridPart = 0.7, kNoiseShare = 0.5, kSimplifyPart = 0.5;
// Rays relative to those of the recipe, scaled from its grid spacing to that of the run.
constexpr double kFewestRays = 0.25, kMostRays = 32.0;
constexpr int kDigits = 6;

class Refiner {
  public:
    Refiner(const Recipe& recipe, const std::vector<std::string>& overrides,
            const std::vector<AskedAccuracy>& asked, const RunOptions& options)
        : recipe_(recipe),
          text_(effective_recipe(recipe)),
          overrides_(overrides),
          asked_(asked),
          options_(options) {}

    RunResult refine() {
        std::optional<double> next = kCoarsest * spacing_;
        while (next) {
            if (!grids_.empty()) keep_record();
            if (!run_on_grid(settings_for(*next))) {  // too coarse for this wafer
                next = *next / kMostRatio;
                continue;
            }
            if (!noise_ && (has_all_asked() || grids_.back().spacing < 1.01 * spacing_)) {
                keep_record();
                run_others();
            }
            report_bars();
            next = next_spacing();
        }
        grids_.back().folder.clear();
        if (!result_) result_ = run_in(options_.output, last_, options_.overwrite);
        add_accuracy();
        return std::move(*result_);
    }

  private:
    Recipe recipe_with(const AccuracySettings& settings) const { return recipe_with(settings, text_); }

    Recipe recipe_with(const AccuracySettings& settings, const std::string& text) const {
        std::vector<std::string> changes{fmt::format("domain.grid_spacing={}", settings.spacing),
                                         fmt::format("simplify.method=\"{}\"", settings.method),
                                         fmt::format("flux.seed={}", settings.seed)};
        changes.push_back(settings.relative_error
                              ? fmt::format("flux.relative_error={:.3g}", *settings.relative_error)
                              : fmt::format("flux.rays={:.0f}", settings.rays));
        return recipe_changed(text, recipe_.file, overrides_, std::move(changes));
    }

    static AccuracyRun describe(const std::string& folder, const AccuracySettings& settings, Json summary) {
        AccuracyRun run{settings, folder, std::move(summary)};
        run.spacing = run.summary["grid_spacing"].get<double>();
        return run;
    }

    // Whether a folder holds a run of this recipe with other settings, which an earlier call may have made.
    bool holds_other_settings(const fs::path& folder, const AccuracySettings& settings,
                              const std::string& text) const {
        if (!is_there(options_.output / kAccuracyFolder) || !is_there(folder / "recipe.toml")) return false;
        if (!options_.resume && !is_there(folder / "summary.json")) return false;
        try {
            return effective_recipe(
                       recipe_with(settings, surface::read_whole_file(folder / "recipe.toml"))) == text;
        } catch (const std::exception&) {
            return false;
        }
    }

    // Runs a recipe in a folder. If options_.resume is set, it goes on with an earlier run of the same recipe
    // there. Earlier grids of this refinement are replaced unasked.
    RunResult run_in(const fs::path& folder, const AccuracySettings& settings, bool overwrite) {
        const Recipe recipe = recipe_with(settings);
        const std::string text = effective_recipe(recipe);
        RunOptions run = options_;
        run.refines = true;
        run.quiet = options_.quiet || folder != options_.output;
        run.output = folder;
        run.resume = options_.resume && holds_recipe(folder, text);
        run.overwrite =
            !run.resume &&
            (overwrite || holds_other_settings(folder, settings, text) ||
             std::ranges::any_of(own_, [&](const auto& own) { return holds_recipe(folder, own); }));
        if (options_.resume && !run.resume && !run.overwrite &&
            (is_there(folder / "summary.json") || is_there(folder / "checkpoint.vdb")))
            throw RecipeError(
                "{}: holds a run that --accuracy cannot go on with, as it is of another recipe or was made "
                "without --accuracy: choose another folder with -o, or replace it with --overwrite",
                folder.string());
        own_.insert(text);
        return run_recipe(recipe, run);
    }

    fs::path record() const {
        return options_.output / kAccuracyFolder / fmt::format("grid_{}", grids_.size() + 1);
    }

    // Summary of the next grid, if this call resumes one that has run it.
    std::optional<Json> kept_summary(const std::string& text) const {
        if (!options_.resume || !holds_recipe(record(), text)) return std::nullopt;
        return own_summary(record());
    }

    // Runs the recipe on a grid. False if the grid is too coarse for the wafer.
    bool run_on_grid(const AccuracySettings& settings) {
        const bool coarse = settings.spacing > 1.01 * spacing_;
        std::string text;
        try {
            const Recipe recipe = recipe_with(settings);
            text = effective_recipe(recipe);
            say(fmt::format("grid spacing {:.4g} {}", domain_of(recipe).spacing, describe_rays(settings)));
        } catch (const RecipeError&) {
            if (!coarse) throw;
            return false;
        }
        try {
            last_ = settings;
            result_.reset();
            if (std::optional<Json> kept = kept_summary(text)) {
                own_.insert(text);
                grids_.push_back(describe("", settings, std::move(*kept)));
            } else {
                result_ = run_in(options_.output, settings, options_.overwrite);
                grids_.push_back(describe("", settings, result_->summary));
            }
            if (!lock_) {
                refuse_link(options_.output / kAccuracyFolder);
                make_folder(options_.output / kAccuracyFolder, "choose another with -o");
                lock_.emplace(options_.output / kAccuracyFolder);
                if (!options_.resume) remove_accuracy_records(options_.output / kAccuracyFolder);
            }
            return true;
        } catch (const GeometryError&) {
            if (!coarse) throw;
        } catch (const NumericsError&) {
            if (!coarse) throw;
        }
        return false;
    }

    // Keeps the record of a run that finer grids follow for the bars, and marks the folder as unfinished.
    void keep_record() {
        AccuracyRun& run = grids_.back();
        if (!run.folder.empty()) return;
        const fs::path folder = options_.output / kAccuracyFolder / fmt::format("grid_{}", grids_.size());
        run.folder = fs::path(kAccuracyFolder) / folder.filename();
        if (!result_) return;
        refuse_link(folder);
        fs::remove(options_.output / "summary.json");
        write_manifest(folder, {"recipe.toml", "summary.json"});
        fs::remove(folder / "recipe.toml");  // so that no summary is ever beside another recipe
        write_json((folder / "summary.json").string(), run.summary);
        write_file(folder / "recipe.toml", surface::read_whole_file(options_.output / "recipe.toml"));
    }

    bool has_all_asked() const {
        return std::ranges::all_of(asked_, [&](const AskedAccuracy& asked) {
            return std::isfinite(grids_.back().figure(asked.measure));
        });
    }

    // Runs with further seeds, and runs without simplification, on the last grid.
    void run_others() {
        std::vector<AccuracyRun> others;
        const bool simplified = last_.method != "none";
        const auto add = [&](const std::string& name, std::int64_t seed, const std::string& method) {
            AccuracySettings settings = last_;
            settings.seed = seed;
            settings.method = method;
            const fs::path folder = fs::path(kAccuracyFolder) / name;
            refuse_link(options_.output / folder);
            say(fmt::format("the same, seed {}{}", seed,
                            method == last_.method ? "" : ", without simplification"));
            others.push_back(describe(folder.string(), settings,
                                      run_in(options_.output / folder, settings, true).summary));
        };
        const std::int64_t seed = last_.seed;
        if (traced_) {
            add("seed_2", seed + 1, last_.method);
            add("seed_3", seed + 2, last_.method);
            if (!simplified) add("seed_4", seed + 3, last_.method);
        }
        if (simplified) add("raw", seed, "none");
        if (simplified && traced_) add("raw_2", seed + 1, "none");
        noise_ = noise_of(grids_.back(), others);
        others_ = std::move(others);
    }

    AccuracyBars bars(const AskedAccuracy& asked) const {
        return app::bars_of(asked.measure, recipe_, grids_, noise_, &asked);
    }

    // Settings of the next grid: rays for the noise asked for, no simplification if its bar is too large.
    AccuracySettings settings_for(double spacing) {
        AccuracySettings settings{.spacing = spacing, .method = method_, .seed = recipe_.flux.seed};
        constexpr std::int64_t kRays = 100'000;  // where the recipe gives none
        const std::int64_t rays = recipe_.flux.rays != 0 ? recipe_.flux.rays : kRays;
        const double wanted = static_cast<double>(rays) * spacing_ / spacing;
        settings.rays = wanted;
        settings.relative_error = recipe_.flux.relative_error;
        if (!noise_) {
            settings.rays = std::max(settings.rays, least_rays_);
            return settings;
        }
        AccuracySettings next = noise_->on;
        next.spacing = spacing;
        double excess = 0.0, change = 0.0;  // over the bars allowed, if only the spacing changes
        for (const AskedAccuracy& asked : asked_) {
            const AccuracyBars now = bars(asked);
            if (!(now.asked > 0.0) || !noise_->noise.contains(asked.measure)) continue;
            const double noise = noise_->noise.at(asked.measure),
                         simplification = noise_->simplification.at(asked.measure);
            excess =
                std::max(excess, noise * noise_factor(noise_->on, next, flat_) / (kNoiseShare * now.asked));
            change = std::max(change, (simplification - noise) * spacing / noise_->on.spacing /
                                          (kSimplifyPart * now.asked));
        }
        if (change > 1.0) settings.method = method_ = "none";
        if (!traced_ || !(excess > 0.0)) return settings;
        if (settings.relative_error)
            settings.relative_error = std::min(
                0.5, std::clamp(*noise_->on.relative_error / excess, *recipe_.flux.relative_error / 8.0,
                                *recipe_.flux.relative_error * 2.0));
        else
            settings.rays =
                std::round(std::max(least_rays_, std::clamp(noise_->on.rays * excess * excess,
                                                            kFewestRays * wanted, kMostRays * wanted)));
        return settings;
    }

    // The next grid's spacing; nothing if the bars are small enough or no finer grid is possible.
    std::optional<double> next_spacing() const {
        double wanted = 0.0;  // ratio of spacings
        bool reached = true;
        for (const AskedAccuracy& asked : asked_) {
            const AccuracyBars now = bars(asked);
            reached = reached && now.reached();
            wanted = std::max(wanted,
                              now.known && now.asked > 0.0 ? now.grid / (kGridPart * now.asked) : kMostRatio);
        }
        if (reached) return std::nullopt;
        const double spacing = grids_.back().spacing, least = kFinest * spacing_ * 0.999,
                     halved = spacing / kMostRatio;
        const double ratio = std::clamp(wanted, kLeastRatio, kMostRatio);
        std::optional<double> next;
        if (ratio < kMostRatio) next = near(spacing / ratio, spacing);
        if (!next) next = halved;
        if (*next < least) return std::nullopt;
        try {
            const Recipe finer =
                recipe_with({.spacing = *next, .rays = least_rays_, .method = method_, .seed = 1});
            require_memory(finer, domain_of(finer));
        } catch (const RecipeError& error) {
            say(error.what());
            return std::nullopt;
        }
        return next;
    }

    // The spacing nearest to \p wanted that fits the extents; nothing if that is hardly finer than the last.
    std::optional<double> near(double wanted, double last) const {
        try {
            Recipe recipe = recipe_;
            recipe.domain.grid_spacing = wanted;
            const double spacing = domain_of(recipe).spacing;
            constexpr double kWorthwhile = 1.25;
            return spacing * kWorthwhile <= last ? std::optional(spacing) : std::nullopt;
        } catch (const RecipeError&) {
            return std::nullopt;
        }
    }

    std::string describe_rays(const AccuracySettings& settings) const {
        const std::string& unit = recipe_.domain.length_unit;
        if (!traced_) return unit;
        const std::string rays = settings.relative_error
                                     ? fmt::format("flux error {:.2g}", *settings.relative_error)
                                     : fmt::format("{:.0f} rays", settings.rays);
        return fmt::format("{}, {}{}", unit, rays,
                           settings.method == "none" ? ", without simplification" : "");
    }

    void say(const std::string& text) const {
        if (!options_.quiet) print_warning("accuracy: " + text);
    }

    void report_bars() const {
        for (const AskedAccuracy& asked : asked_) {
            const AccuracyBars now = bars(asked);
            say(fmt::format("{} {:.5g} +- {}, asked for {}", asked.measure, now.value,
                            now.known ? fmt::format("{:.2g}", now.total()) : "unknown: " + now.reason,
                            asked.text));
        }
    }

    Json bars_of(const std::string& measure, const AskedAccuracy* asked) const {
        return bars_json(app::bars_of(measure, recipe_, grids_, noise_, asked), asked);
    }

    void add_accuracy() {
        Json& summary = result_->summary;
        summary["accuracy"] = Json::object();
        for (const auto& entry : summary["metrology"].items()) {
            const std::string& measure = entry.key();
            const auto asked = std::ranges::find(asked_, measure, &AskedAccuracy::measure);
            summary["accuracy"][measure] = bars_of(measure, asked == asked_.end() ? nullptr : &*asked);
        }
        // A figure that does not exist on this wafer may have no entry in the metrology.
        for (const AskedAccuracy& asked : asked_)
            if (!summary["accuracy"].contains(asked.measure))
                summary["accuracy"][asked.measure] = bars_of(asked.measure, &asked);
        double total = 0.0;
        summary["accuracy_runs"] = Json::array();
        for (const auto* runs : {&grids_, &others_})
            for (const AccuracyRun& run : *runs) {
                summary["accuracy_runs"].push_back(run_json(run));
                total += run.seconds();
            }
        summary["accuracy_seconds"] = Json{{"total", number_or_null(total, kDigits)},
                                           {"settled", number_or_null(grids_.back().seconds(), kDigits)}};
        write_json((options_.output / "summary.json").string(), summary);
    }

    const Recipe& recipe_;
    const std::string text_;
    const std::vector<std::string>& overrides_;
    const std::vector<AskedAccuracy>& asked_;
    const RunOptions& options_;
    const double spacing_ = domain_of(recipe_).spacing;
    const bool flat_ = is_flat(recipe_.domain), traced_ = traces(recipe_);
    // Fewest rays of a run: fewer tell nothing, or do not suffice for one a batch.
    const double least_rays_ = std::max(1000.0, static_cast<double>(recipe_.flux.batches));
    std::string method_ = recipe_.simplify.method;  // of simplification on the next grids
    std::set<std::string> own_;                     // effective recipes of all runs so far
    AccuracySettings last_;
    std::vector<AccuracyRun> grids_, others_;
    std::optional<AccuracyNoise> noise_;
    std::optional<RunResult> result_;  // on the last grid, unless its summary was read
    std::optional<FolderLock> lock_;
};

}  // namespace

bool traces(const Recipe& recipe) {
    for (const Step& step : expanded_steps(recipe))
        if (step.built && !step.built->species.empty()) return true;
    return false;
}

RunResult run_to_accuracy(const Recipe& recipe, const std::vector<std::string>& overrides,
                          const std::vector<AskedAccuracy>& asked, const RunOptions& options) {
    if (!recipe.start.from.empty())
        throw RecipeError(
            "--accuracy: {} starts from another run and so on its grid: ask it of a recipe with layers",
            recipe.file);
    return Refiner(recipe, overrides, asked, options).refine();
}

}  // namespace sidewall::app
