#include "levelset/layers/levels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "levelset/layers/level_features.hpp"
#include "levelset/layers/make_stack.hpp"
#include "levelset/layers/prolongation.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::levelset {
namespace {

constexpr int kNodes = LevelColumns::kNodes, kShift = LevelColumns::kShift;

// Gives columns at the ends of an axis the same flag: a last one without cells and the one before it; at a
// periodic side, where both ends of the surface must be one line, the first and the last.
void close_ends(const Domain& domain, LevelColumns& columns) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const int last = columns.count[axis] - 1, across = columns.count[1 - axis];
        const auto column = [&](int k, int n) -> std::uint8_t& {
            return axis == 0 ? columns.at(k, n) : columns.at(n, k);
        };
        for (int n = 0; n < across && last > 0; ++n) {
            if (domain.side[axis] == Side::periodic) {
                const std::uint8_t any = column(0, n) | column(last, n);
                column(0, n) = any, column(last, n) = any;
            } else if (domain.cells[axis] % kNodes == 0) {
                column(last, n) = column(last - 1, n);
            }
        }
    }
}

// Calls use(x, y) with the columns of 2^shift nodes a side that hold nodes of block (x, y), which is \p nodes
// wide, and of the blocks within \p reach around it.
template <class Use>
void each_column_around(const Domain& domain, int nodes, int x, int y, int reach, int shift, Use&& use) {
    each_column_between(domain, {nodes * (x - reach), nodes * (y - reach)},
                        {nodes * (x + reach + 1) - 1, nodes * (y + reach + 1) - 1}, shift, use);
}

// The columns of a domain that hold nodes of \p columns, which are \p nodes of the domain wide, or of columns
// around them within \p reach.
LevelColumns widened(const Domain& domain, const LevelColumns& columns, int nodes, int reach) {
    LevelColumns result = all_columns(domain).none();
    for (int x = 0; x < columns.count[0]; ++x)
        for (int y = 0; y < columns.count[1]; ++y)
            if (columns.at(x, y))
                each_column_around(domain, nodes, x, y, reach, kShift,
                                   [&](int i, int j) { result.at(i, j) = 1; });
    return result;
}

void unite(LevelColumns& columns, const LevelColumns& more) {
    for (std::size_t n = 0; n < columns.own.size(); ++n) columns.own[n] |= more.own[n];
}

// The source of a level's leaves, by column, when \p columns become its own: columns that were its own before
// keep their values.
LeafColumns leaf_columns(const MaterialStack& stack, const LevelColumns& columns) {
    const LevelColumns with_margin = widened(stack.domain, columns, kNodes, stack.margin);
    LeafColumns result{columns.count, {}};
    for (std::size_t n = 0; n < columns.own.size(); ++n)
        result.source.push_back(columns.own[n] && stack.columns.own[n] ? LeafColumn::kept
                                : with_margin.own[n]                   ? LeafColumn::interpolated
                                                                       : LeafColumn::none);
    return result;
}

void set_columns(MaterialStack& stack, LevelColumns columns) {
    const LeafColumns leaves = leaf_columns(stack, columns);
    stack.columns = std::move(columns);
    prolongate(stack, leaves);
}

// Samples each level where the coarser one shows features. The finest one's values are not distances yet.
MaterialStack sample_levels(const Domain& domain, int levels, int margin, const StackSampler& sample) {
    if (levels == 1) return sample(domain, {});
    MaterialStack stack{domain, {}};
    stack.coarser =
        std::make_shared<MaterialStack>(sample_levels(coarser_domain(domain), levels - 1, margin, sample));
    stack.columns = all_columns(domain);
    // Two more columns on each side (one of the coarser level), which finer levels read beyond their own.
    stack.columns = widened(domain, columns_of_features(stack), kNodes, 2);
    stack.margin = 2;  // leaves beside missing columns, in which distances will be off
    const LeafColumns leaves = leaf_columns(stack, stack.columns);
    stack.layers = sample(domain, [&](int x, int y) { return leaves.at(x, y) != LeafColumn::none; }).layers;
    stack.margin = margin;
    make_distances(*stack.coarser);
    return stack;
}

// The level set of twice the spacing with the same front. As its narrow band is twice as wide, its values are
// distances from the front's mesh.
GridPtr coarser_grid(const Grid& grid, const Domain& domain) {
    const TriangleMesh front = extract_surface(grid, domain);
    if (front.triangles.empty()) return make_grid(coarser_domain(domain));
    const surface::RayScene scene(front);
    const auto distance = [&](const Vec3& p) {
        const Vec3 index = domain.to_index(p);
        const auto own = [&](int axis) {
            return std::clamp(static_cast<int>(std::lround(index[axis])), 0, domain.last_node(axis));
        };
        const double d = scene.closest_point(p, std::numeric_limits<double>::max(), domain.period()).distance;
        return inside(grid, openvdb::Coord(own(0), own(1), static_cast<int>(std::lround(index.z())))) ? -d
                                                                                                      : d;
    };
    const double margin = 2.0 * (kHalfWidth + 1.0) * domain.spacing;
    const auto [low, high] = band_z_range(grid, domain);
    return sample_grid(coarser_domain(domain), distance, low - margin, high + margin);
}

// The next coarser level of a stack that holds all of the domain.
std::shared_ptr<MaterialStack> made_coarser(const MaterialStack& stack) {
    auto coarser = std::make_shared<MaterialStack>();
    coarser->domain = coarser_domain(stack.domain);
    for (const Layer& layer : stack.layers)
        coarser->layers.push_back({layer.material, coarser_grid(*layer.phi, stack.domain)});
    return coarser;
}

void inject_all(MaterialStack& stack) {
    for (MaterialStack* level = &stack; level->coarser; level = level->coarser.get())
        inject(*level, level->columns);
}

void prolongate_margins(MaterialStack& stack) {
    if (!stack.coarser) return;
    prolongate_margins(*stack.coarser);
    prolongate(stack, leaf_columns(stack, stack.columns));
}

}  // namespace

LevelColumns all_columns(const Domain& domain) {
    LevelColumns columns{{(domain.last_node(0) >> kShift) + 1, (domain.last_node(1) >> kShift) + 1}, {}};
    columns.own.assign(static_cast<std::size_t>(columns.count[0] * columns.count[1]), 1);
    return columns;
}

Domain coarser_domain(const Domain& domain) {
    Domain coarser = domain;
    coarser.spacing = 2.0 * domain.spacing;
    coarser.times_finest = 2 * domain.times_finest;
    for (int& cells : coarser.cells) cells /= 2;
    return coarser;
}

int level_count(const MaterialStack& stack) {
    return stack.coarser ? 1 + level_count(*stack.coarser) : 1;
}

int most_levels(const Domain& domain) {
    constexpr int kMost = 3, kLeastCells = 4;
    int levels = 1;
    for (int factor = 2; levels < kMost; factor *= 2, ++levels)
        for (const int cells : domain.cells)
            if (cells % factor != 0 || cells / factor < kLeastCells) return levels;
    return levels;
}

void make_levels(MaterialStack& stack, int levels, int margin) {
    MaterialStack* level = &stack;
    for (int n = 1; n < levels; ++n, level = level->coarser.get()) {
        level->margin = margin;
        level->columns = all_columns(level->domain);
        level->coarser = made_coarser(*level);
        inject(*level, level->columns);
    }
    choose_columns(stack, {});
}

MaterialStack make_levels(const Domain& domain, int levels, int margin, const StackSampler& sample) {
    MaterialStack stack = sample_levels(domain, levels, margin, sample);
    make_distances(stack);
    choose_columns(stack, {});
    return stack;
}

MaterialStack on_one_level(const MaterialStack& stack) {
    MaterialStack all = copy(stack);
    if (!all.coarser) return all;
    *all.coarser = on_one_level(*all.coarser);
    set_columns(all, all_columns(all.domain));
    all.coarser = nullptr;
    all.columns = {};
    all.margin = 0;
    return all;
}

void exchange_levels(MaterialStack& stack) {
    for (MaterialStack* level = &stack; level->coarser; level = level->coarser.get()) {
        LevelColumns rest = level->columns;
        const LevelColumns deep = deep_columns(*level);
        for (std::size_t n = 0; n < rest.own.size(); ++n)
            if (deep.own[n] != 0) rest.own[n] = 0;
        inject(*level, rest);
    }
    prolongate_margins(stack);
}

void choose_columns(MaterialStack& stack, const std::vector<LevelColumns>& wanted) {
    inject_all(stack);
    std::vector<MaterialStack*> levels;
    for (MaterialStack* level = &stack; level->coarser; level = level->coarser.get()) levels.push_back(level);
    std::vector<LevelColumns> chosen;
    for (std::size_t n = 0; n < levels.size(); ++n) {
        LevelColumns columns = columns_of_features(*levels[n]);
        if (!wanted.empty()) unite(columns, wanted[n]);
        // Also a column around those of the finer level, so that levels that meet differ by a factor of two.
        if (n > 0) unite(columns, widened(levels[n]->domain, chosen.back(), kNodes / 2, 1));
        close_ends(levels[n]->domain, columns);
        chosen.push_back(std::move(columns));
    }
    for (std::size_t n = levels.size(); n-- > 0;) set_columns(*levels[n], chosen[n]);
}

LevelColumns deep_columns(const MaterialStack& finer) {
    const Domain& domain = finer.coarser->domain;
    const LevelColumns& own = finer.columns;
    LevelColumns deep = own;
    for (int x = 0; x < deep.count[0]; ++x)
        for (int y = 0; y < deep.count[1]; ++y)
            if (own.at(x, y))
                each_column_around(domain, 8, x >> 1, y >> 1, finer.margin, kShift - 1, [&](int i, int j) {
                    if (!own.at(i, j)) deep.at(x, y) = 0;
                });
    return deep;
}

bool counts_in(const MaterialStack& level, const MaterialStack* finer, int x, int y) {
    const Domain& domain = level.domain;
    for (const int i : {domain.source_node(0, x - 1), x, x + 4})
        for (const int j : {domain.source_node(1, y - 1), y, y + 4})
            if (domain.owns(i, j) && counts_at(level, finer, i, j)) return true;
    return false;
}

const MaterialStack& level_at(const MaterialStack& stack, const Vec3& point) {
    if (!stack.coarser) return stack;
    const Vec3 index = stack.domain.to_index(point);
    const auto node = [&](int axis) {
        const int n = static_cast<int>(std::floor(index[axis]));
        return std::clamp(n, 0, stack.domain.last_node(axis));
    };
    return stack.columns.of_node(node(0), node(1)) ? stack : level_at(*stack.coarser, point);
}

MaterialStack upper_layers(const MaterialStack& stack, std::ptrdiff_t count) {
    MaterialStack upper = stack;
    upper.layers.assign(stack.layers.end() - count, stack.layers.end());
    if (stack.coarser) upper.coarser = std::make_shared<MaterialStack>(upper_layers(*stack.coarser, count));
    return upper;
}

std::vector<std::size_t> voxels_by_level(const MaterialStack& stack) {
    std::vector<std::size_t> voxels;
    for (const MaterialStack* level = &stack; level != nullptr; level = level->coarser.get()) {
        std::size_t sum = 0;
        for (const Layer& layer : level->layers) sum += layer.phi->activeVoxelCount();
        voxels.push_back(sum);
    }
    return voxels;
}

}  // namespace sidewall::levelset
