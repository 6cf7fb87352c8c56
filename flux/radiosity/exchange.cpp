#include "flux/radiosity/exchange.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include "flux/radiosity/gatherer.hpp"
#include "flux/radiosity/profile_view.hpp"
#include "flux/random.hpp"
#include "flux/tracer/monitor.hpp"
#include "flux/tracer/trace_checks.hpp"
#include "flux/tracer/tracer.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

constexpr std::uint32_t kStream = 0xffff0000u;  // key of the random numbers; no species has this number

// Shares of cosine rays and connections among the rays; the others start at the source.
constexpr double kCosineShare = 0.4, kConnectShare = 0.4;

std::vector<Job> jobs_of(const RayCounts& counts, std::size_t exponents, std::uint32_t groups) {
    std::vector<Job> jobs;
    const auto add = [&](Job job, std::uint32_t rays) {
        for (job.first = 0; job.first < rays; job.first += kBlock) {
            job.count = std::min(static_cast<std::uint32_t>(kBlock), rays - job.first);
            jobs.push_back(job);
        }
    };
    for (std::uint32_t group = 0; group < groups; ++group) {
        add({group, RayKind::cosine}, counts.cosine);
        add({group, RayKind::connect}, counts.connect);
        for (std::uint32_t n = 0; n < exponents; ++n) add({group, RayKind::source, n}, counts.source);
    }
    return jobs;
}

// Adds a block's samples to its group, with weights times the rays a group of this gather.
void book(Exchange::State& s, const Job& job, BlockSamples& found, double rays) {
    SampleGroup& group = s.groups[job.group];
    const auto scale = static_cast<float>(rays);
    for (PairSample& pair : found.pairs) pair.weight *= scale;
    for (ExitSample& exit : found.exits) exit.weight *= scale;
    group.pairs.insert(group.pairs.end(), found.pairs.begin(), found.pairs.end());
    group.exits.insert(group.exits.end(), found.exits.begin(), found.exits.end());
    s.segments += found.flights.segments;
    s.leaked += found.leaked;
}

enum Size : std::size_t { kPairCount, kExitCount, kSegmentCount, kRescuedCount, kLeakedCount, kCounts };

// The sizes and counters of each job's samples, in the order of Size.
std::vector<std::uint64_t> counts_of(std::span<const BlockSamples> found) {
    std::vector<std::uint64_t> sizes;
    sizes.reserve(kCounts * found.size());
    for (const BlockSamples& one : found)
        sizes.insert(sizes.end(), {one.pairs.size(), one.exits.size(), one.flights.segments,
                                   one.flights.rescued, one.leaked});
    return sizes;
}

// Exchanges the samples of some consecutive jobs between the ranks. \p first: number of the first job.
void share_lists(const Shares& shares, std::span<BlockSamples> found, std::size_t first,
                 std::span<const std::uint64_t> sizes) {
    std::vector<std::uint64_t> words;
    // Copies this rank's own lists into `words`, or those of the others out of them; only measures while
    // `words` is empty. Returns the number of bytes of all lists.
    const auto move = [&](bool own) {
        std::size_t at = 0;
        const auto move_list = [&](auto& list, std::size_t count, bool moves) {
            if (moves && !own) list.resize(count);
            const std::size_t size = count * sizeof list[0];
            char* place = reinterpret_cast<char*>(words.data()) + at;
            if (moves && own && size > 0) std::memcpy(place, list.data(), size);
            if (moves && !own && size > 0) std::memcpy(list.data(), place, size);
            at += size;
        };
        for (std::size_t i = 0; i < found.size(); ++i) {
            const bool moves = !words.empty() && own == ((first + i) % shares.ranks == shares.rank);
            move_list(found[i].pairs, sizes[kCounts * i + kPairCount], moves);
            move_list(found[i].exits, sizes[kCounts * i + kExitCount], moves);
        }
        return at;
    };
    words.resize(move(true) / sizeof(std::uint64_t) + 1, 0);
    move(true);
    shares.sum(words);
    move(false);
}

// Gives every rank the samples of all ranks. Job i is traced by rank i modulo the number of ranks; the others
// have zeros there, so that a sum over the ranks yields its samples.
void share_samples(const Shares& shares, std::span<BlockSamples> found) {
    if (shares.ranks == 1) return;
    std::vector<std::uint64_t> sizes = counts_of(found);
    shares.sum(sizes);
    constexpr std::size_t kTogether = 512;  // jobs a message: about 20 MB
    for (std::size_t first = 0; first < found.size(); first += kTogether) {
        const std::size_t count = std::min(kTogether, found.size() - first);
        share_lists(shares, found.subspan(first, count), first,
                    std::span(sizes).subspan(kCounts * first, kCounts * count));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
        found[i].flights = {sizes[kCounts * i + kSegmentCount], sizes[kCounts * i + kRescuedCount]};
        found[i].leaked = sizes[kCounts * i + kLeakedCount];
    }
}

std::vector<BlockSamples> trace_all(const Exchange::State& s, const std::vector<Job>& jobs, RandomKey key,
                                    bool pilot) {
    std::vector<BlockSamples> found(jobs.size());
    const Shares& shares = s.options.shares;
    static const std::function<void(double)> kSilent;
    Monitor monitor(pilot ? kSilent : s.options.progress, s.options.stop);
    monitor.expect(jobs.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, jobs.size(), 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                if (monitor.stop()) return;
                // Ranks take turns, but all trace a pilot's few rays: that is cheaper than a message.
                if (pilot || i % shares.ranks == shares.rank)
                    found[i] = trace_job(s, key, s.gathers, jobs[i], pilot);
                monitor.finished(1);
            }
        },
        tbb::simple_partitioner{});
    if (monitor.stop()) throw Interrupted("interrupted while tracing rays between points of the surface");
    if (!pilot) share_samples(shares, found);
    return found;
}

// Numbers of pairs and exits in each group.
using Sizes = std::array<std::pair<std::size_t, std::size_t>, kSampleGroups>;

Sizes sizes_of(const Exchange::State& s) {
    Sizes sizes;
    for (std::size_t g = 0; g < kSampleGroups; ++g)
        sizes[g] = {s.groups[g].pairs.size(), s.groups[g].exits.size()};
    return sizes;
}

// Adds the samples gathered since \p before to the exchange between aggregates, in the groups' order.
void add_to_aggregates(Exchange::State& s, const Sizes& before) {
    tbb::parallel_for(std::size_t{0}, s.aggregate_exchange.size(), [&](std::size_t pair) {
        for (const std::size_t g : {2 * pair, 2 * pair + 1})
            add_exchange(s.aggregates, s.profile.unknowns, s.groups[g], before[g].first, before[g].second,
                         s.aggregate_exchange[pair]);
    });
}

// Makes the matrices, aggregates and densities that gathers and solves need besides samples; only once.
void prepare(Exchange::State& s) {
    if (s.densities) return;
    s.mass = mass_matrix(s.geometry.mesh, s.profile.unknowns);
    s.aggregates = make_aggregates(s.geometry.mesh, s.profile.unknowns);
    const auto count = static_cast<Eigen::Index>(s.aggregates.count);
    s.aggregate_exchange.fill(Eigen::MatrixXd::Zero(count, count));
    s.densities.emplace(s.geometry, s.profile, s.source_exponents);
    if (s.geometry.revolution)
        s.sky = sky_of_rings(s.geometry, s.profile, s.source_exponents, s.options.stop);
}

// Adapts the ray densities by a pilot: a few rays from surface and source, whose samples are dropped.
void trace_pilot(Exchange::State& s, RandomKey key, std::uint64_t rays) {
    const auto few = static_cast<std::uint32_t>(std::clamp<std::size_t>(
        std::min<std::size_t>(4 * s.geometry.mesh.triangles.size(), rays / 4), 1024, 16384));
    s.densities->set_counts({.cosine = few, .source = few});
    const std::vector<BlockSamples> found = trace_all(s, jobs_of(s.densities->counts(), 1, 1), key, true);
    const std::size_t items = s.geometry.mesh.triangles.size();
    std::vector<double> images(std::size_t{kImageRow} * kImageRow, 0.0), lit(items, 0.0), started(items, 0.0),
        kept(items, 0.0);
    for (const BlockSamples& part : found) {
        for (std::size_t i = 0; i < images.size(); ++i) images[i] += part.images[i];
        for (const std::uint32_t t : part.lit) lit[s.densities->item_of(t)] += 1.0;
        for (const std::uint32_t t : part.started) started[s.densities->item_of(t)] += 1.0;
        for (const PairSample& pair : part.pairs) kept[s.densities->item_of(pair.a)] += 1.0;
        s.segments += part.flights.segments;
    }
    const std::vector<double> share = s.densities->share_kept(started, kept);
    std::vector<double> openings(RayDensities::kCells * RayDensities::kCells, 0.0);
    for (const BlockSamples& part : found)
        for (std::size_t i = 0; i < part.openings.size(); ++i)
            openings[part.openings[i]] += share[s.densities->item_of(part.lit[i])];
    s.densities->set_images(images);
    s.densities->set_openings(openings);
    s.densities->set_relays(lit, share);
}

// Computes the whole exchange of a profile by view_profile().
void take_view(Exchange::State& s, RandomKey key) {
    // A view counts as kLikeRays rays. Residual rays, which measure the elements' error, are traced for that
    // number, and leaks are the leaked share of all directions times it.
    constexpr std::uint64_t kLikeRays = 100'000;
    prepare(s);
    s.view = view_profile(s.geometry, s.profile, s.source_exponents, s.options.stop);
    s.aggregate_exchange.front() = aggregate_sums(s.aggregates, s.mass, s.view->exchange);
    s.gathers = 1;
    s.rays = kLikeRays;
    // Leaks below this share come from folds at sharp edges and change fluxes by no more than that.
    constexpr double kLeastLeak = 5e-4;
    if (s.view->leaked > kLeastLeak)
        s.leaked = static_cast<std::uint64_t>(s.view->leaked * static_cast<double>(kLikeRays));
    trace_residual(s.geometry, *s.densities, key, s.gathers, kLikeRays, s.residual);
    s.segments = s.view->parts + s.residual.segments;
}

void require_few_leaks(const Exchange::State& s) {
    if (!leaks_too_much(s.leaked, s.rays, 3.0)) return;
    if (s.viewed)
        throw NumericsError(
            "{:.2g} % of all that the profile sees is the back of a facet, or nothing: it has holes, overlaps, pieces "
            "turned inside out or, with periodic sides, opposite ends that do not match",
            100.0 * s.view->leaked);
    throw NumericsError(
        "{} of {} rays went through the surface: it has holes, overlaps, pieces turned inside out that are "
        "hidden from above or, with periodic sides, opposite ends that do not match",
        s.leaked, s.rays);
}

}  // namespace

std::uint64_t exchange_bytes(std::uint64_t rays) {
    // Twice the samples: a gather holds its blocks beside the groups, a solve its balanced weights.
    return 2 * sizeof(PairSample) * rays;
}

std::uint64_t view_bytes(std::size_t unknowns) {
    return 4 * sizeof(double) * unknowns * unknowns;
}

Exchange::Exchange(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                   const Wedges& wedges, std::vector<double> source_exponents, ExchangeOptions options) {
    check_fit(mesh, box, wedges);
    if (source_exponents.empty() || source_exponents.size() > 16)
        throw RecipeError("{} source exponents: give 1 to 16", source_exponents.size());
    for (const double n : source_exponents)
        if (!(n >= 0.0 && n <= 1e6)) throw RecipeError("source_exponent = {}: must be in [0, 1e6]", n);
    Geometry geometry = make_geometry(mesh, scene, box);
    ProfileUnknowns profile = make_profile_unknowns(geometry, wedges);
    geometry.straight = geometry.straight && !profile.partner.empty();
    state_ = std::unique_ptr<State>(
        new State{geometry, wedges, std::move(profile), std::move(options), std::move(source_exponents)});
    state_->viewed = can_be_viewed(state_->geometry, state_->profile, state_->source_exponents) &&
                     view_bytes(unknowns()) < state_->options.most_bytes;
}

void Exchange::gather(std::uint64_t rays) {
    State& s = *state_;
    const RandomKey key = random_key(s.options.seed, s.options.time_step, kStream);
    const auto start = std::chrono::steady_clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    if (s.viewed) {
        if (s.gathers == 0) take_view(s, key);
        s.seconds += seconds();
        return require_few_leaks(s);
    }
    const std::uint64_t needed = exchange_bytes(s.rays + rays);
    if (needed > s.options.most_bytes)
        throw RecipeError(
            "radiosity of {} rays needs {:.3g} GB, above the {:.3g} GB allowed: ask for a larger relative error or "
            "allow more",
            s.rays + rays, static_cast<double>(needed) * 1e-9,
            static_cast<double>(s.options.most_bytes) * 1e-9);
    if (s.gathers == 0) {
        prepare(s);
        trace_pilot(s, key, rays);  // as gather 0, with its own random numbers
    }
    ++s.gathers;
    const std::size_t exponents = s.densities->exponents().size();
    const double group_rays = static_cast<double>(rays) / kSampleGroups;
    const auto share = [&](double part) {
        return std::max<std::uint32_t>(1, static_cast<std::uint32_t>(std::lround(part * group_rays)));
    };
    const double source = s.sky ? 0.0 : (1.0 - kCosineShare - kConnectShare) / static_cast<double>(exponents);
    s.densities->set_counts(
        {share(s.sky ? 0.5 : kCosineShare), share(s.sky ? 0.5 : kConnectShare), s.sky ? 0 : share(source)});
    const RayCounts& counts = s.densities->counts();
    const std::vector<Job> jobs = jobs_of(counts, exponents, kSampleGroups);
    std::vector<BlockSamples> found = trace_all(s, jobs, key, false);
    const std::uint64_t in_group = counts.cosine + counts.connect + exponents * counts.source;
    const Sizes before = sizes_of(s);
    s.forget_balanced();
    for (std::size_t i = 0; i < jobs.size(); ++i) {
        book(s, jobs[i], found[i], static_cast<double>(in_group));
        found[i] = {};
    }
    for (SampleGroup& group : s.groups)
        for (std::size_t i = 0; s.sky && i < s.sky->exits.size(); ++i) {
            group.exits.push_back(s.sky->exits[i]);
            group.exits.back().weight *= static_cast<float>(in_group);
        }
    add_to_aggregates(s, before);
    const std::uint64_t segments = s.residual.segments;
    trace_residual(s.geometry, *s.densities, key, s.gathers, rays, s.residual);
    s.segments += s.residual.segments - segments;
    s.group_rays += in_group;
    s.rays += in_group * kSampleGroups;
    s.seconds += seconds();
    require_few_leaks(s);
}

void Exchange::set_start_variance(std::span<const double> variance) {
    prepare(*state_);
    state_->densities->set_starts(variance);
    state_->has_importance = true;
}

void Exchange::set_residual_error(std::span<const double> error) {
    prepare(*state_);
    state_->residual.share = shares_of_edges(*state_->densities, error);
}

std::uint64_t Exchange::samples() const {
    std::uint64_t samples = 0;
    for (const SampleGroup& group : state_->groups) samples += group.pairs.size() + group.exits.size();
    return samples;
}

std::uint64_t Exchange::rays_left() const {
    const std::uint64_t most = state_->options.most_bytes / (2 * sizeof(PairSample));
    return most > state_->rays ? most - state_->rays : 0;
}

double Exchange::State::scale(std::uint32_t bits) const {
    return viewed ? 1.0 : 1.0 / (static_cast<double>(group_rays) * std::popcount(bits));
}

const BalancedSamples& Exchange::State::balanced(std::uint32_t bits) const {
    const std::lock_guard lock(mutex_);
    const auto found = balanced_.find(bits);
    if (found != balanced_.end()) return found->second;
    if (view)
        return balanced_.try_emplace(bits, profile.unknowns, *view, mass, source_exponents).first->second;
    std::vector<const SampleGroup*> chosen;
    for (std::size_t g = 0; g < groups.size(); ++g)
        if ((bits >> g & 1u) != 0) chosen.push_back(&groups[g]);
    // Isolated: while this thread waits for its own tasks, it must not take a task that locks the same mutex.
    const auto make = [&] {
        return balanced_
            .try_emplace(bits, profile.unknowns, std::move(chosen), scale(bits), sky ? &*sky : nullptr)
            .first;
    };
    return tbb::this_task_arena::isolate(make)->second;
}

}  // namespace sidewall::flux
