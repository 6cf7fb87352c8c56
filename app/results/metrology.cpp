#include "app/results/metrology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "app/recipe/recipe_domain.hpp"
#include "app/results/figure_values.hpp"
#include "app/results/result.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/volume.hpp"
#include "levelset/motion/geometric.hpp"

namespace sidewall::app {
namespace {

// The narrowest opening within two grid spacings above the mask's bottom, whose lower edge may be worn.
double mask_opening(const Profile& profile, double bottom, double spacing) {
    constexpr int kSamples = 16;
    double narrowest = std::numeric_limits<double>::quiet_NaN();
    for (int k = 1; k <= kSamples; ++k)
        narrowest = std::fmin(narrowest, opening(profile, bottom + 2.0 * spacing * k / kSamples));
    return narrowest;
}

// Openings at equal distances from z = 0 down to the floor, none of them at the ends.
struct Wall {
    double step = 0.0;
    std::vector<double> opening;  // number k lies (k + 1/2) step below z = 0
};

Wall wall(const Profile& profile, double depth, double spacing) {
    Wall result;
    if (!(depth > 2.0 * spacing)) return result;
    const int count = wall_samples(depth, spacing);
    result.step = depth / count;
    for (int k = 0; k < count; ++k) result.opening.push_back(opening(profile, -(k + 0.5) * result.step));
    return result;
}

// Slope of y over x by least squares, over the middle half of \p count points; NaN if fewer than \p fewest of
// these are finite.
template <class Point>
double slope_of(std::size_t count, double fewest, const Point& point) {
    double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
    for (std::size_t k = count / 4; k < 3 * count / 4; ++k) {
        const auto [x, y] = point(k);
        if (!std::isfinite(y)) continue;
        n += 1.0, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    const double spread = n * sxx - sx * sx;
    return n >= fewest && spread > 0.0 ? (n * sxy - sx * sy) / spread : kNone;
}

// The angle of the line fitted to half the opening over z, in degrees; 90 for a vertical wall.
double sidewall_angle(const Wall& wall) {
    const double slope = slope_of(wall.opening.size(), 3.0, [&](std::size_t k) {
        return std::pair(-(static_cast<double>(k) + 0.5) * wall.step, 0.5 * wall.opening[k]);
    });
    return std::atan2(1.0, slope) * 180.0 / std::numbers::pi;
}

// The wafer without a material; nothing if it has none, or if the substrate is of it.
std::optional<levelset::MaterialStack> stripped(const levelset::MaterialStack& stack, int material) {
    const std::vector<int> there = layer_materials(stack);
    if (there.front() == material || std::find(there.begin(), there.end(), material) == there.end())
        return std::nullopt;
    levelset::MaterialStack bare = levelset::on_one_level(stack);
    levelset::strip(bare, material);
    return bare;
}

// Takes the measures of a section; what several of them need is computed once.
class Metrologist {
  public:
    Metrologist(const Recipe& recipe, const MetrologySection& section, const levelset::MaterialStack& stack,
                const TriangleMesh& mesh)
        : recipe_(recipe),
          section_(section),
          stack_(stack),
          cut_(stack, mesh, surface::parse_plane(section.cut)) {}

    std::vector<Measure> take() {
        for (const std::string& what : section_.measures) {
            if (what == "film")
                add_film();
            else if (what == "scallops")
                add_scallops();
            else if (what == "voids")
                add_voids();
            else if (what == "cd")
                for (const double at : section_.cd_depths)
                    add(fmt::format("cd_at_{:g}", at), opening(cut_.open(), -at));
            else if (const auto figure = named_figure(what, recipe_.materials))
                add_named(*figure);
            else
                add_shape(what);
        }
        return measures_;
    }

  private:
    void add(std::string name, double value) {
        measures_.push_back({std::move(name), value, recipe_.domain.length_unit});
    }
    void add_pure(std::string name, double value) { measures_.push_back({std::move(name), value, "1"}); }

    double depth() {
        const double floor = span_of_profile(cut_.open()).floor;
        return std::isfinite(floor) ? -floor : kNone;
    }
    const Wall& openings() {
        if (!openings_) openings_ = wall(cut_.open(), depth(), stack_.domain.spacing);
        return *openings_;
    }

    void add_named(const Figure& figure) {
        if (figure.kind == FigureKind::without) {
            if (stripped_ != figure.stripped) {
                bare_ = stripped(stack_, figure.stripped);
                if (bare_) bare_surface_ = levelset::extract_surface(*bare_);
                stripped_ = figure.stripped;
            }
            const Measure bare = bare_ ? measure_named(recipe_, figure.of, *bare_, bare_surface_)
                                       : measure_named(recipe_, figure.of, stack_, cut_.surface());
            measures_.push_back({figure.name, bare.value, bare.unit});
        } else {
            const bool volume = figure.kind == FigureKind::volume;
            measures_.push_back({figure.name, figure_value(recipe_, figure, cut_),
                                 volume ? volume_unit(recipe_) : recipe_.domain.length_unit});
        }
    }
    void add_shape(const std::string& what) {
        const double dx = stack_.domain.spacing;
        if (what == "depth") {
            add(what, depth());
        } else if (what == "sidewall_angle") {
            measures_.push_back({what, sidewall_angle(openings()), "degree"});
        } else if (what == "bow") {
            const double mouth = opening(cut_.open(), -dx);
            double widest = mouth;
            for (const double w : openings().opening) widest = std::fmax(widest, w);
            add(what, widest - mouth);
        } else if (what == "undercut") {
            const double z = section_.mask_bottom;
            add(what, 0.5 * (opening(cut_.open(), z - dx) - mask_opening(cut_.open(), z, dx)));
        } else if (what == "aspect_ratio") {
            add_pure(what, depth() / opening(cut_.open(), -0.5 * depth()));
        } else if (what == "seam_depth") {
            add(what, stack_.layers.size() > 1 ? seam_depth(cut_.open(), cut_.open_below(), dx) : kNone);
        }
    }
    void add_scallops() {
        const Scallops found = scallops(openings().opening, openings().step, stack_.domain.spacing);
        add("scallop_pitch", found.pitch);
        add("scallop_depth", found.depth);
    }
    void add_voids() {
        const Voids found =
            voids_in(cut_.surface(), cut_.pieces(), stack_.domain, surface::plane_axes(cut_.plane())[0]);
        add_pure("voids", found.count);
        const double divisor = volume_divisor(recipe_);
        const std::string unit = volume_unit(recipe_);
        measures_.push_back({"void_volume", found.volume / divisor, unit});
        measures_.push_back({"void_volume_whole", found.whole_volume / divisor, unit});
        add("void_top", -found.top);
        add("void_width", found.width);
    }
    void add_film() {
        const double dx = stack_.domain.spacing;
        Film t;
        if (stack_.layers.size() > 1)
            t = film_between(cut_.layer(stack_.layers.size() - 1), cut_.open_below(), dx);
        add("film_top", t.top);
        add("film_side", t.side);
        add("film_bottom", t.bottom);
        add_pure("step_coverage_side", t.coverage(t.side, dx));
        add_pure("step_coverage_bottom", t.coverage(t.bottom, dx));
    }

    const Recipe& recipe_;
    const MetrologySection& section_;
    const levelset::MaterialStack& stack_;
    WaferCut cut_;
    std::optional<Wall> openings_;
    int stripped_ = -1;                            // the last material that was stripped
    std::optional<levelset::MaterialStack> bare_;  // the result of stripped() for it
    TriangleMesh bare_surface_;
    std::vector<Measure> measures_;
};

// A place where the wall stands out into the opening; its height is the lesser of those over its two sides.
struct Edge {
    std::size_t at;
    double height;
};

// The half openings from the mouth down to the floor, which begins where the wall is under 80 degrees steep.
std::vector<double> half_wall(std::span<const double> openings, double step) {
    constexpr double kSteep = 5.67;  // tan(80 degrees)
    std::vector<double> half;
    half.reserve(openings.size());
    for (const double w : openings)
        if (std::isfinite(w)) half.push_back(0.5 * w);
    while (half.size() > 1 && half[half.size() - 2] - half.back() > step / kSteep) half.pop_back();
    return half;
}

// The farthest that the wall recedes from a place, in direction \p by, before it stands out more than there.
double rise(const std::vector<double>& half, std::size_t from, std::ptrdiff_t by) {
    double most = half[from];
    const auto n = static_cast<std::ptrdiff_t>(half.size());
    for (auto k = static_cast<std::ptrdiff_t>(from) + by; k >= 0 && k < n; k += by) {
        const double here = half[static_cast<std::size_t>(k)];
        if (here < half[from]) break;
        most = std::max(most, here);
    }
    return most - half[from];
}

std::vector<Edge> edges_of(const std::vector<double>& half, double least) {
    std::vector<Edge> edges;
    for (std::size_t k = 1; k + 1 < half.size(); ++k) {
        if (!(half[k] < half[k - 1] && half[k] <= half[k + 1])) continue;
        const double height = std::min(rise(half, k, -1), rise(half, k, 1));
        if (height > least) edges.push_back({k, height});
    }
    std::ranges::sort(edges, std::greater(), &Edge::height);
    // Sorted by height, the list ends where the ratio of an edge to the next one is largest: what follows is
    // noise. The last edge is compared with the least height. Two edges are kept at least.
    std::size_t count = edges.size();
    double widest = 0.0;
    for (std::size_t k = 2; k <= edges.size(); ++k) {
        const double next = k < edges.size() ? edges[k].height : least, ratio = edges[k - 1].height / next;
        if (ratio > widest) widest = ratio, count = k;
    }
    edges.resize(count);
    std::ranges::sort(edges, {}, &Edge::at);
    return edges;
}

// The median of the distances between neighbouring edges.
double usual_distance(const std::vector<Edge>& edges) {
    std::vector<double> distances;
    for (std::size_t k = 0; k + 1 < edges.size(); ++k)
        distances.push_back(static_cast<double>(edges[k + 1].at - edges[k].at));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

// Keeps the highest of edges less than a distance apart: the others are remains of film beside it.
void drop_beside(std::vector<Edge>& edges, double distance) {
    std::vector<Edge> kept;
    for (const Edge& edge : edges)
        if (kept.empty() || static_cast<double>(edge.at - kept.back().at) >= distance)
            kept.push_back(edge);
        else if (edge.height > kept.back().height)
            kept.back() = edge;
    edges = std::move(kept);
}

// The deepest place between two edges, behind the line through them.
double depth_between(const std::vector<double>& half, std::size_t from, std::size_t to) {
    double most = 0.0;
    for (std::size_t k = from; k <= to; ++k) {
        const double share = static_cast<double>(k - from) / static_cast<double>(to - from);
        most = std::max(most, half[k] - (1.0 - share) * half[from] - share * half[to]);
    }
    return most;
}

// Number of cycles of all innermost loops, each counted in every cycle of the loops around it.
double cycles_of(const std::vector<Step>& steps) {
    double cycles = 0.0;
    for (const Step& step : steps)
        if (!step.steps.empty())
            cycles += static_cast<double>(step.repeat) * std::max(1.0, cycles_of(step.steps));
    return cycles;
}

}  // namespace

std::vector<Measure> measure(const Recipe& recipe, const levelset::MaterialStack& stack,
                             const TriangleMesh& mesh) {
    return measure(recipe, recipe.metrology, stack, mesh);
}

std::vector<Measure> measure(const Recipe& recipe, const MetrologySection& section,
                             const levelset::MaterialStack& stack, const TriangleMesh& mesh) {
    if (section.measures.empty()) return {};
    return Metrologist(recipe, section, stack, mesh).take();
}

bool is_listed(const Measure& measure) {
    return std::isfinite(measure.value) || !measure.name.starts_with("step_coverage");
}

Measure measure_named(const Recipe& recipe, const std::string& name, const levelset::MaterialStack& stack,
                      const TriangleMesh& surface) {
    MetrologySection one = recipe.metrology;
    one.measures = {named_figure(name, recipe.materials) ? name : word_of(recipe, name).value_or(name)};
    for (const Measure& measure : measure(recipe, one, stack, surface))
        if (measure.name == name) return measure;
    return {name, kNone, ""};
}

std::vector<int> layer_materials(const levelset::MaterialStack& stack) {
    std::vector<int> materials;
    for (const levelset::Layer& layer : stack.layers) materials.push_back(layer.material);
    return materials;
}

std::vector<double> layer_volumes(const levelset::MaterialStack& stack) {
    std::vector<double> volumes;
    double below = 0.0;
    for (std::size_t k = 0; k < stack.layers.size(); ++k) {
        const double volume = levelset::volume_of(stack, k);
        volumes.push_back(volume - below);
        below = volume;
    }
    return volumes;
}

Scallops scallops(std::span<const double> openings, double step, double spacing) {
    std::vector<double> half = half_wall(openings, step);
    const double slope =
        slope_of(half.size(), 2.0, [&](std::size_t k) { return std::pair(static_cast<double>(k), half[k]); });
    for (std::size_t k = 0; k < half.size() && std::isfinite(slope); ++k)
        half[k] -= slope * static_cast<double>(k);
    std::vector<Edge> edges = edges_of(half, 0.05 * spacing);
    if (edges.size() < 2) return {};
    const double usual = usual_distance(edges);
    drop_beside(edges, 0.5 * usual);
    double pitches = 0.0;
    for (std::size_t k = 0; k + 1 < edges.size(); ++k)
        pitches += std::round(static_cast<double>(edges[k + 1].at - edges[k].at) / usual);
    Scallops found{static_cast<double>(edges.back().at - edges.front().at) * step / pitches, 0.0};
    for (std::size_t k = 0; k + 1 < edges.size(); ++k)
        found.depth +=
            depth_between(half, edges[k].at, edges[k + 1].at) / static_cast<double>(edges.size() - 1);
    return found;
}

std::string scallop_note(const Recipe& recipe, const Json& metrology) {
    const Json summary{{"metrology", metrology}};
    const double cycles = cycles_of(recipe.steps), pitch = figure_of(summary, "scallop_pitch"),
                 depth = figure_of(summary, "depth"), product = cycles * pitch;
    constexpr double kNear = 0.2, kResolved = 8.0;  // cells
    if (cycles == 0.0 || !metrology.contains("scallop_pitch")) return {};
    const std::string& length = recipe.domain.length_unit;
    if (std::abs(product - depth) > kNear * depth)
        return fmt::format(
            "scallop_pitch: {:g} cycles of {:.4g} {} are {:.4g} {}, but the depth is {:.4g} {}: some cycles have left no "
            "scallop of their own, or some scallops are finer than the grid",
            cycles, pitch, length, product, length, depth, length);
    const double each = std::isnan(pitch) ? depth / cycles : pitch, cells = each / recipe.domain.grid_spacing;
    if (!(cells > 0.0 && cells < kResolved)) return {};
    return fmt::format(
        "scallop_depth: scallops {:.3g} {} high have {:.2g} cells; with less than {:g} the grid rounds their edges off, "
        "and they come out up to half too shallow, or not at all: use a grid_spacing of {:.2g} or less",
        each, length, cells, kResolved, each / kResolved);
}

}  // namespace sidewall::app
