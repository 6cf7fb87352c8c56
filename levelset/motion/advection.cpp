#include "levelset/motion/advection.hpp"

#include <tbb/tick_count.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "levelset/band.hpp"
#include "levelset/large_vector.hpp"
#include "levelset/layers/cut_layers.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/layers/prolongation.hpp"
#include "levelset/motion/hamiltonian.hpp"
#include "levelset/motion/limits.hpp"
#include "levelset/motion/sample_index.hpp"
#include "levelset/motion/sample_speeds.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "levelset/rounding.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

// The surface's leaves during a time step.
struct Stages {
    std::vector<Leaf*> leaves;
    surface::LeafTable table;         // of the leaves
    LargeVector<float> before;        // phi at the time step's start, if it is needed
    LargeVector<float> start;         // phi at the start of this part of the time step, if it is needed
    LargeVector<float> next;          // phi after a stage, in leaves that move
    std::vector<std::uint8_t> moved;  // by leaf: some node has had a speed, whether or not values changed
    std::vector<std::uint8_t> changed;
    std::vector<Nodes> held;             // by leaf: nodes at edges of etching bodies (Band::held), or empty
    const LevelColumns* deep = nullptr;  // finer level's columns under which none moves; null: all do
};

// Entries for a leaf that an extension does not contain.
constexpr auto kNoSamples = [] {
    std::array<std::int32_t, Leaf::SIZE> entries{};
    entries.fill(SampleIndex::kNone);
    return entries;
}();

bool any_moves(const Leaf& leaf, const std::int32_t* sample, const SampleSpeeds& speeds) {
    for (auto it = leaf.cbeginValueOn(); it; ++it)
        if (speeds.moves(SampleIndex::sample(sample[it.pos()]))) return true;
    return false;
}

// out = keep * phi0 + (1 - keep) * (phi - dt H(phi)): one stage of a strong-stability-preserving Runge-Kutta
// scheme (Shu and Osher, J. Comput. Phys. 77 (1988) 439). phi0 is phi at the start of the time step or of its
// part; the first stage (keep = 0) saves it. Leaves in which nothing has a speed do not change.
template <int R>
void stage(Stages& stages, const std::vector<const std::int32_t*>& samples, const Grid& grid,
           const SampleSpeeds& speeds, double duration, float keep) {
    const float background = grid.background();
    const float limit = std::nextafter(background, 0.0f);  // keeps voxels in the band until re-distancing
    const auto dt = static_cast<float>(duration), dx = static_cast<float>(speeds.stack.domain.spacing);
    const LeafData data(stages.table, stages.leaves);
    surface::parallel_each(stages.leaves.size(), 4, [&](std::size_t n) {
        const Leaf& leaf = *stages.leaves[n];
        const std::int32_t* sample = samples[n];
        const float* phi = leaf.buffer().data();
        if (keep == 0.0f && !stages.start.empty())
            std::copy_n(phi, Leaf::SIZE, &stages.start[n * Leaf::SIZE]);
        if (stages.deep && stages.deep->of_coarser_node(leaf.origin().x(), leaf.origin().y())) return;
        if (!stages.moved[n]) stages.moved[n] = any_moves(leaf, sample, speeds);
        if (!stages.moved[n]) return;
        Block<R> block;
        Row h;
        load_axes(data, speeds.stack.domain, leaf, background, block);
        const float* phi0 = keep > 0.0f ? &stages.start[n * Leaf::SIZE] : nullptr;
        float* out = &stages.next[n * Leaf::SIZE];
        std::copy_n(phi, Leaf::SIZE, out);
        for (int row = 0; row < 64; ++row) {
            const auto first = static_cast<std::size_t>(8 * row);
            const auto active =
                leaf.getValueMask().template getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
            if (active == 0) continue;
            hamiltonian_row(block, row >> 3, row & 7, sample + first, speeds, h);
            Row values;
            for (std::size_t z = 0; z < kLanes; ++z) values[z] = phi[first + z] - dt * h[z];
            if (phi0)
                for (std::size_t z = 0; z < kLanes; ++z)
                    values[z] = keep * phi0[first + z] + (1.0f - keep) * values[z];
            for (std::size_t z = 0; z < kLanes; ++z) {
                // Values near 0 are rounded to 0, unless phi was 0: a front on the node may leave it slowly.
                const float rounded = without_rounding(values[z], dx);
                const float value = without_rounding(phi[first + z], dx) == 0.0f ? values[z] : rounded;
                values[z] = std::min(std::max(value, -limit), limit);
            }
            blend(values, kLaneMasks[active], out + first);
        }
        if (!std::equal(out, out + Leaf::SIZE, phi)) stages.changed[n] = 1;
    });
    surface::parallel_each(stages.leaves.size(), 4, [&](std::size_t n) {
        if (stages.moved[n] && stages.changed[n])
            std::copy_n(&stages.next[n * Leaf::SIZE], Leaf::SIZE, stages.leaves[n]->buffer().data());
    });
}

// The nodes of each leaf at edges of bodies that etch whose values are held. Re-distancing would spoil them:
// next to the edge distances have a kink at the front, and deep in a thin mask they are those from its other
// face. Farther from the front than kHeldCells it gives the same values.
std::vector<Nodes> nodes_at_edges(const std::vector<Leaf*>& leaves,
                                  const std::vector<const std::int32_t*>& samples,
                                  const SampleSpeeds& speeds) {
    constexpr double kHeldCells = 2.5;
    const auto farthest =
        -(static_cast<float>(kHeldCells) + kTie) * static_cast<float>(speeds.stack.domain.spacing);
    std::vector<Nodes> held(samples.size());
    const Extension& extension = speeds.motion.extension;
    const auto at_cover = [&](std::size_t sample) {
        return extension.at_cover.empty() || sample < extension.plain() ||
               extension.at_cover[sample - extension.plain()] != 0;
    };
    surface::parallel_each(samples.size(), 16, [&](std::size_t n) {
        const float* phi = leaves[n]->buffer().data();
        for (openvdb::Index node = 0; node < Leaf::SIZE; ++node) {
            const std::int32_t sample = SampleIndex::sample(samples[n][node]);
            if (sample >= 0 && phi[node] >= farthest &&
                speeds.way[static_cast<std::size_t>(sample)] == SampleSpeeds::Way::as_distance &&
                at_cover(static_cast<std::size_t>(sample)))
                held[n].setOn(node);
        }
    });
    return held;
}

// The share of phi0 (see stage) that each Runge-Kutta stage keeps.
std::span<const float> kept_shares(TimeIntegration scheme) {
    static constexpr float kEuler[] = {0.0f}, kRk2[] = {0.0f, 0.5f}, kRk3[] = {0.0f, 0.75f, 1.0f / 3.0f};
    switch (scheme) {
        case TimeIntegration::rk3:
            return kRk3;
        case TimeIntegration::rk2:
            return kRk2;
        case TimeIntegration::euler:
            break;
    }
    return kEuler;
}

// The number of parts of a time step in each of which the waves of a speed that depends on the normal get at
// most 0.7 of the way to the neighbouring nodes. A Courant number of 1 would be stable, but holds back the
// foot of a steep facet, which moves twice as fast as the facet: by a cell for a yield that peaks at 70
// degrees. The smaller the number, the more hollow corners and walls are rounded.
int stable_parts(const SampleSpeeds& speeds) {
    constexpr double kCourant = 0.7, kMostParts = 64.0;
    const double waves = speeds.fastest_wave * speeds.duration / speeds.stack.domain.spacing;
    return static_cast<int>(std::clamp(std::ceil(waves / kCourant * (1.0 - 1e-6)), 1.0, kMostParts));
}

// Saves phi before the time step.
void note_values(Stages& stages) {
    stages.before.resize(stages.leaves.size() * Leaf::SIZE);
    surface::parallel_each(stages.leaves.size(), 64, [&](std::size_t n) {
        std::copy_n(stages.leaves[n]->buffer().data(), Leaf::SIZE, &stages.before[n * Leaf::SIZE]);
    });
}

template <int R>
Stages integrate(MaterialStack& stack, const LevelColumns* deep, std::span<const Motion* const> motions,
                 std::size_t count, double duration, const AdvectionOptions& options) {
    Grid& grid = stack.top();
    Stages stages;
    stages.deep = deep;
    grid.tree().getNodes(stages.leaves);
    stages.table = surface::LeafTable(stages.leaves);
    const std::size_t values = stages.leaves.size() * Leaf::SIZE;
    stages.next.resize(values);
    stages.moved.resize(stages.leaves.size(), 0);
    stages.changed.resize(stages.leaves.size(), 0);
    if (count > 1) stages.start.resize(values);
    if (stack.layers.size() > 1) note_values(stages);
    std::optional<SampleSpeeds> speeds;
    std::vector<const std::int32_t*> samples;  // by leaf
    int parts = 1, part = 0;
    for (std::size_t k = 0; part < parts; k = (k + 1) % count, part += k == 0) {
        if (k < motions.size() && (part == 0 || motions.size() > 1)) {
            speeds.emplace(sample_speeds(stack, *motions[k], options.scheme, duration));
            samples.clear();
            for (const Leaf* leaf : stages.leaves) {
                const std::int32_t* entries = motions[k]->extension.sample_of->find(leaf->origin());
                samples.push_back(entries ? entries : kNoSamples.data());
            }
            if (k == 0) parts = std::max(parts, stable_parts(*speeds));
            if (part == 0 && k == 0 && !motions[k]->extension.body.empty())
                stages.held = nodes_at_edges(stages.leaves, samples, *speeds);
        }
        stage<R>(stages, samples, grid, *speeds, duration / parts, kept_shares(options.time_integration)[k]);
    }
    stages.next = LargeVector<float>();  // frees memory for re-distancing
    return stages;
}

Stages integrate(MaterialStack& stack, const LevelColumns* deep, std::span<const Motion* const> motions,
                 std::size_t stages, double duration, const AdvectionOptions& options) {
    switch (options.scheme) {
        case Scheme::weno5:
            return integrate<3>(stack, deep, motions, stages, duration, options);
        case Scheme::lax_friedrichs:
            if (motions.front()->law.dissipation.empty()) break;
            [[fallthrough]];
        case Scheme::engquist_osher:
            return integrate<1>(stack, deep, motions, stages, duration, options);
        case Scheme::weno3:
            break;
    }
    return integrate<2>(stack, deep, motions, stages, duration, options);
}

AdvectionSeconds move_level(MaterialStack& stack, MaterialStack* finer,
                            std::span<const Motion* const> motions, std::size_t count, double duration,
                            const AdvectionOptions& options) {
    const tbb::tick_count start = tbb::tick_count::now();
    LevelColumns deep;
    if (finer != nullptr) {
        deep = deep_columns(*finer);
        inject(*finer, deep);
    }
    Stages stages = integrate(stack, finer != nullptr ? &deep : nullptr, motions, count, duration, options);
    Band band(stages.leaves, stages.table, stack.domain, stages.changed);
    band.held = std::move(stages.held);
    std::optional<Limits> limits;
    std::optional<Grown> grown;
    if (stack.layers.size() > 1) {
        limits.emplace(stack, band, stages.moved, stages.before.data(), *motions.front(), duration);
        limits->keep(stack.top());
        grown.emplace(mark_exposed(stack, stages.leaves, stages.table, stages.before.data()));
    }
    const tbb::tick_count moved = tbb::tick_count::now();
    // Schemes of crystals, and of laws without surface normals, smear edges over cells: phi is no distance.
    const SpeedLaw& law = motions.front()->law;
    const bool smears = law.depends_on_normal && law.normal.empty() && !law.beam_speed;
    const Start is = smears ? Start::function : Start::distance;
    redistance(band, stack.top(), stack.domain, kSweepsAfterTimeStep, is);
    // Re-distancing near a sharp turn of the front is off by a fraction of a cell: limit again.
    if (limits) limits->keep(stack.top());
    cut_layers(stack, grown ? &*grown : nullptr);
    return {(moved - start).seconds(), (tbb::tick_count::now() - moved).seconds()};
}

AdvectionSeconds run_stages(MaterialStack& stack, std::span<const Motion> motions, std::size_t count,
                            double duration, const AdvectionOptions& options) {
    std::vector<const Motion*> of_level;
    for (const Motion& motion : motions) of_level.push_back(&motion);
    AdvectionSeconds sum;
    MaterialStack* finer = nullptr;
    for (MaterialStack* level = &stack; level != nullptr; finer = level, level = level->coarser.get()) {
        const bool empty = level->coarser && level->top().tree().leafCount() == 0;  // it counts nowhere
        const AdvectionSeconds more =
            empty ? AdvectionSeconds{} : move_level(*level, finer, of_level, count, duration, options);
        sum.advect += more.advect;
        sum.redistance += more.redistance;
        for (const Motion*& motion : of_level) motion = motion->coarser.get();
    }
    const tbb::tick_count moved = tbb::tick_count::now();
    if (stack.coarser) exchange_levels(stack);
    sum.redistance += (tbb::tick_count::now() - moved).seconds();
    return sum;
}

}  // namespace

AdvectionSeconds advect(MaterialStack& stack, std::span<const Motion> motions, double duration,
                        const AdvectionOptions& options) {
    return run_stages(stack, motions, stage_count(options.time_integration), duration, options);
}

AdvectionSeconds advect(MaterialStack& stack, const Motion& motion, double duration,
                        const AdvectionOptions& options) {
    return advect(stack, std::span(&motion, 1), duration, options);
}

void advect_to_stage(MaterialStack& stack, std::span<const Motion> motions, double duration,
                     const AdvectionOptions& options) {
    run_stages(stack, motions, motions.size(), duration, options);
}

}  // namespace sidewall::levelset
