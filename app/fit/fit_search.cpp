#include "app/fit/fit_search.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <stdexcept>

#include "app/fit/fit_errors.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Eigen::VectorXd;

constexpr double kMet = 0.01;       // root mean square, relative to the values asked for
constexpr double kMetSigmas = 2.0;  // in standard deviations, where these are known
constexpr double kApart = 0.1;      // least distance of two minima, in the unit box
constexpr double kBeside = 0.01;    // largest distance of points of one minimum, in the unit box

// All points that a search has evaluated, each once.
class Trials {
  public:
    explicit Trials(const LeastSquares& problem) : problem_(problem) {}

    const std::vector<FitTrial>& all() const { return all_; }
    std::size_t left() const { return problem_.max_runs - std::min(problem_.max_runs, all_.size()); }

    std::vector<Residuals> evaluate(const std::vector<BoxPoint>& points) {
        std::vector<Residuals> residuals = problem_.evaluate(points);
        for (std::size_t i = 0; i < points.size(); ++i) all_.push_back({points[i], residuals[i]});
        return residuals;
    }

    const FitTrial& at(const BoxPoint& x) {
        const auto known = std::ranges::find(all_, x, &FitTrial::x);
        if (known != all_.end()) return *known;
        evaluate({x});
        return all_.back();
    }

    const FitTrial& best() const { return *std::ranges::min_element(all_, {}, &FitTrial::cost); }

    // Least squares from the best of \p known, or from the first points if empty, with the runs left.
    LeastSquaresResult fit(std::vector<FitTrial> known, std::optional<double> noise, bool descends = true) {
        LeastSquares problem = problem_;
        problem.evaluate = [this](const std::vector<BoxPoint>& x) { return evaluate(x); };
        problem.max_runs = known.size() + left();
        problem.known = std::move(known);
        problem.noise = noise;
        problem.descends = descends;
        LeastSquaresResult found = fit_least_squares(problem);
        found.runs = all_.size();
        return found;
    }

  private:
    const LeastSquares& problem_;
    std::vector<FitTrial> all_;
};

// The objective of NLopt. Points without residuals cost more than all others.
struct SumOfSquares {
    Trials& trials;
    std::size_t most = 0;   // trials allowed; repeated points, as at bounds, count once
    double greatest = 1.0;  // finite cost so far
    std::exception_ptr failure;
};

double sum_of_squares(unsigned count, const double* x, double*, void* data) {
    SumOfSquares& sum = *static_cast<SumOfSquares*>(data);
    const BoxPoint point =
        Eigen::Map<const VectorXd>(x, static_cast<Eigen::Index>(count)).cwiseMax(0.0).cwiseMin(1.0);
    double cost = kInfinity;
    try {
        cost = sum.trials.at(point).cost();
    } catch (...) {
        sum.failure = std::current_exception();
    }
    if (sum.failure || sum.trials.all().size() >= sum.most) throw nlopt::forced_stop();
    if (!std::isfinite(cost)) return 2.0 * sum.greatest;
    sum.greatest = std::max(sum.greatest, cost);
    return cost;
}

// Minimises the sum of squares by NLopt, from the best point so far. False if it ended for want of runs.
bool minimise(Trials& trials, nlopt::algorithm algorithm, std::size_t runs, std::size_t population) {
    constexpr double kFirstStep = 0.2;  // in the unit box
    constexpr std::size_t kMostRepeats = 10;
    SumOfSquares sum{.trials = trials, .most = trials.all().size() + runs};
    for (const FitTrial& trial : trials.all())
        if (const double cost = trial.cost(); std::isfinite(cost))
            sum.greatest = std::max(sum.greatest, cost);
    std::vector<double> x(trials.best().x.begin(), trials.best().x.end());
    nlopt::opt search(algorithm, static_cast<unsigned>(x.size()));
    search.set_min_objective(sum_of_squares, &sum);
    search.set_lower_bounds(0.0);
    search.set_upper_bounds(1.0);
    search.set_maxeval(static_cast<int>(kMostRepeats * runs));
    if (population > 0) {
        nlopt::srand(1);
        search.set_population(static_cast<unsigned>(population));
    } else {
        search.set_xtol_abs(kSearchTolerance);
        search.set_initial_step(kFirstStep);
    }
    try {
        double least = 0.0;
        return search.optimize(x, least) != nlopt::MAXEVAL_REACHED;
    } catch (const nlopt::roundoff_limited&) {
        return true;  // the points are so close that rounding hides their difference
    } catch (const std::runtime_error&) {
        if (sum.failure) std::rethrow_exception(sum.failure);
        return false;
    }
}

// Runs that the final Gauss-Newton fit takes: for noise, slopes from both sides, and some steps.
std::size_t last_runs(Eigen::Index parameters) {
    return static_cast<std::size_t>(4 * parameters + 6);
}

std::size_t fewest_at_random(Eigen::Index parameters) {
    return last_runs(parameters) + 4 * (static_cast<std::size_t>(parameters) + 1);
}

// Runs that are kept for repeats, which show the noise; a spread takes two.
std::size_t count_repeats(const LeastSquares& problem) {
    const std::size_t kept = std::min(kRepeats, problem.max_runs / 4);
    return problem.repeat && kept > 1 ? kept : 0;
}

void require_runs_for_crs(const LeastSquares& problem) {
    const std::size_t fewest = count_first(problem.start.size()) + fewest_at_random(problem.start.size()),
                      repeats = count_repeats(problem);
    if (problem.max_runs - repeats < fewest)
        throw RecipeError("--method crs with {} keys takes at least {} runs: raise --max-runs, now {}",
                          problem.start.size(), fewest + (problem.repeat ? kRepeats : 0), problem.max_runs);
}

// A random search by NLopt. False if too few runs are left for it.
bool search_at_random(Trials& trials, Eigen::Index parameters) {
    const auto n = static_cast<std::size_t>(parameters);
    const std::size_t usual = 10 * (n + 1), kept = last_runs(parameters);
    if (trials.left() < fewest_at_random(parameters)) return false;
    const std::size_t runs = std::min(std::max(2 * usual, trials.left() / 2), trials.left() - kept);
    minimise(trials, nlopt::GN_CRS2_LM, runs, runs / 2);
    return true;
}

// Whether two results are different minima: apart by over kApart, free directions aside.
bool are_apart(const LeastSquaresResult& a, const LeastSquaresResult& b) {
    VectorXd between = b.best - a.best;
    for (const LeastSquaresResult* found : {&a, &b})
        for (const VectorXd& free : found->free_directions) between -= free.dot(between) * free;
    return between.lpNorm<Eigen::Infinity>() > kApart;
}

// The trials that are nearer to one of the first points, the one farthest from \p end, than to \p end.
std::vector<FitTrial> trials_near_farthest(const Trials& trials, std::size_t first_count,
                                           const BoxPoint& end) {
    const FitTrial* farthest = nullptr;
    for (std::size_t i = 0; i < std::min(first_count, trials.all().size()); ++i) {
        const FitTrial& trial = trials.all()[i];
        if (std::isfinite(trial.cost()) &&
            (farthest == nullptr || (trial.x - end).norm() > (farthest->x - end).norm()))
            farthest = &trial;
    }
    std::vector<FitTrial> beyond;
    for (const FitTrial& trial : trials.all())
        if (farthest != nullptr && (trial.x - farthest->x).norm() < (trial.x - end).norm())
            beyond.push_back(trial);
    return beyond;
}

FitSearch search_by_itself(Trials& trials, const LeastSquares& problem) {
    FitSearch search{.found = trials.fit({}, {})};
    LeastSquaresResult& found = search.found;
    const bool known = problem.known_errors;
    if (!found.converged || meets_targets(found, known) || trials.left() < last_runs(problem.start.size()))
        return search;
    std::vector<FitTrial> beyond = trials_near_farthest(trials, first_points(problem).size(), found.best);
    if (beyond.empty()) return search;
    LeastSquaresResult other = trials.fit(std::move(beyond), found.noise);
    search.several_minima = other.converged && are_apart(found, other);
    if (other.residuals.norm() < found.residuals.norm()) std::swap(found, other);
    found.runs = trials.all().size();
    if (search.several_minima && !meets_targets(found, known) &&
        search_at_random(trials, problem.start.size()))
        found = trials.fit(trials.all(), found.noise);
    return search;
}

FitSearch search_by(const std::string& method, Trials& trials, const LeastSquares& problem) {
    if (method == "auto") return search_by_itself(trials, problem);
    if (method == "gauss-newton") return {.found = trials.fit({}, {})};
    trials.evaluate(first_points(problem));
    // If no run has all targets, nothing is searched, and the fit throws.
    const bool any = std::isfinite(trials.best().cost());
    if (method == "crs") {
        if (any) search_at_random(trials, problem.start.size());
        return {.found = trials.fit(trials.all(), {})};
    }
    const std::size_t kept = last_runs(problem.start.size()),
                      runs = trials.left() - std::min(trials.left(), kept);
    const bool ended = any && runs > 0 && minimise(trials, nlopt::LN_BOBYQA, runs, 0);
    const BoxPoint end = trials.best().x;
    LeastSquaresResult found = trials.fit(trials.all(), {}, false);
    // The search has missed the minimum if a point that was evaluated for slopes is lower, unless it is as
    // near as the points that show the noise.
    found.converged = ended && (found.best - end).lpNorm<Eigen::Infinity>() < kBeside;
    return {.found = std::move(found)};
}

// The steps of residuals that change in steps of the grid, else 0. Such a residual is equal to the last digit
// at points near the optimum, though slopes or other points say that it differs: its step is the largest such
// difference. Two points may be equal by chance if it is within the noise, three are not.
VectorXd grid_steps(const Trials& trials, const LeastSquares& problem, const LeastSquaresResult& found) {
    constexpr double kNearest = 0.002, kPart = 0.1, kVanishing = 1e-6, kNoises = 4.0;
    std::vector<const FitTrial*> near;
    VectorXd steps = VectorXd::Zero(found.residuals.size()), range = steps, noise = noise_over_seeds(found);
    if (noise.size() == 0) noise.setConstant(steps.size(), found.noise);
    for (const FitTrial& trial : trials.all()) {
        if (!std::isfinite(trial.cost())) continue;
        range = range.cwiseMax((*trial.residuals - found.residuals).cwiseAbs());
        if ((trial.x - found.best).lpNorm<Eigen::Infinity>() <= kMostDifference) near.push_back(&trial);
    }
    // Profiles are left out: points at surfaces that the process does not change have equal distances, too.
    for (const ProfileResiduals& profile : problem.profiles)
        range.segment(profile.first, static_cast<Eigen::Index>(profile.points.size())).setZero();
    for (Eigen::Index i = 0; i < steps.size(); ++i) {
        if (range[i] == 0.0) continue;
        const double slope = found.slopes.row(i).norm();
        for (const FitTrial* one : near) {
            double greatest = 0.0;
            int equal = 0;
            for (const FitTrial* other : near) {
                if ((*one->residuals)[i] != (*other->residuals)[i]) continue;
                const VectorXd between = one->x - other->x;
                if (between.lpNorm<Eigen::Infinity>() < kNearest) continue;
                const double change = std::abs(found.slopes.row(i).dot(between));
                if (change < kPart * slope * between.norm() && slope >= kVanishing * range[i]) continue;
                greatest = std::max({greatest, change, kVanishing * range[i]});
                ++equal;
            }
            if (equal > 1 || greatest > kNoises * noise[i]) steps[i] = std::max(steps[i], greatest);
        }
    }
    return steps;
}

}  // namespace

double misfit(const LeastSquaresResult& found) {
    return found.residuals.norm() / std::sqrt(static_cast<double>(found.residuals.size()));
}

bool meets_targets(const LeastSquaresResult& found, bool known_errors) {
    return misfit(found) <= (known_errors ? kMetSigmas : std::max(kMet, 3.0 * found.noise));
}

FitSearch search_least_squares(const LeastSquares& problem, const std::string& method) {
    if (method == "crs") require_runs_for_crs(problem);
    LeastSquares searched = problem;
    searched.max_runs -= count_repeats(problem);
    Trials trials(searched);
    FitSearch search = search_by(method, trials, searched);
    LeastSquaresResult& found = search.found;
    if (found.tested.cols() == 0) return search;
    std::vector<VectorXd> repeats;
    if (const std::size_t count = count_repeats(problem); count > 0)
        for (Residuals& residuals : problem.repeat(found.best, count))
            if (residuals && residuals->allFinite()) repeats.push_back(*std::move(residuals));
    found.repeats.resize(found.residuals.size(), static_cast<Eigen::Index>(repeats.size()));
    for (std::size_t k = 0; k < repeats.size(); ++k)
        found.repeats.col(static_cast<Eigen::Index>(k)) = repeats[k];
    found.grid_steps = grid_steps(trials, searched, found);
    add_intervals(searched, found);
    return search;
}

}  // namespace sidewall::app
