#include "app/results/figure_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/recipe/flat.hpp"
#include "app/results/cut_profile.hpp"
#include "levelset/meshes/extract.hpp"

namespace sidewall::app {
namespace {

double widest(const Stretches& stretches) {
    double most = kNone;
    for (const auto& [from, to] : stretches)
        if (std::isfinite(to - from)) most = std::fmax(most, to - from);
    return most;
}

double total(const Stretches& stretches) {
    double sum = 0.0;
    for (const auto& [from, to] : stretches) sum += to - from;
    return std::isfinite(sum) ? sum : kNone;
}

// Thickness of the stretch that ends at a wall; 0 if another material is there.
double behind(const Stretches& stretches, double wall, bool left, double touching) {
    for (const auto& [from, to] : stretches)
        if (std::abs((left ? to : from) - wall) <= touching) return to - from;
    return 0.0;
}

template <class Cuts>
double on_walls(const Cuts& cuts, int material, double z) {
    const auto [left, right] = widest_opening(cuts.open, z);
    if (!std::isfinite(right - left)) return kNone;
    const Stretches own = cuts.of_material(material, [&](const Profile& p) { return solid_at(p, z); });
    const double touching = levelset::thinnest_film(cuts.stack.domain);
    const double sum = behind(own, left, true, touching) + behind(own, right, false, touching);
    return std::isfinite(sum) ? 0.5 * sum : kNone;
}

// Half of how much wider the opening is where the material bounds it on both sides, by the median of the
// heights (beside its neighbours' corners the boundary is slanted), than where it is narrowest. The floor,
// where an opening begins that is still less than 80 degrees steep, does not count.
template <class Cuts>
double recess(const Cuts& cuts, int material) {
    const double dx = cuts.stack.domain.spacing, touching = levelset::thinnest_film(cuts.stack.domain);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    cuts.open.each_segment([&](const Vec3& p, const Vec3& q) {
        low = std::min({low, p.z(), q.z()});
        high = std::max({high, p.z(), q.z()});
    });
    std::vector<double> widths;
    double narrowest = kNone, below = 0.0;
    bool floor = true;
    if (!(high > low)) return kNone;
    const int count = static_cast<int>(std::ceil(4.0 * (high - low) / dx));
    for (int k = 0; k < count; ++k) {
        const double z = low + (k + 0.5) * (high - low) / count;
        const auto [left, right] = widest_opening(cuts.open, z);
        if (!std::isfinite(right - left)) continue;
        constexpr double kSteep = 5.67;  // tan(80 degrees)
        floor = floor && right - left - below > 2.0 * (high - low) / count / kSteep;
        below = right - left;
        if (floor) continue;
        const Stretches own = cuts.of_material(material, [&](const Profile& p) { return solid_at(p, z); });
        const bool both =
            behind(own, left, true, touching) > 0.0 && behind(own, right, false, touching) > 0.0;
        if (both) widths.push_back(right - left);
        narrowest = std::fmin(narrowest, right - left);
    }
    if (widths.empty()) return kNone;
    std::sort(widths.begin(), widths.end());
    return 0.5 * (0.5 * (widths[(widths.size() - 1) / 2] + widths[widths.size() / 2]) - narrowest);
}

double volume(const levelset::MaterialStack& stack, int material) {
    const std::vector<double> volumes = layer_volumes(stack);
    double sum = 0.0;
    for (std::size_t k = 0; k < volumes.size(); ++k)
        if (stack.layers[k].material == material) sum += volumes[k];
    return sum;
}

double variance(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    double mean = 0.0, sum = 0.0;
    for (const double v : values) mean += v / n;
    for (const double v : values) sum += (v - mean) * (v - mean);
    return sum / (n - 1.0);
}

// The opening of a row that overlaps most with another row's.
std::pair<double, double> opening_over(const Profile& profile, double z,
                                       const std::pair<double, double>& other) {
    std::pair<double, double> most{kNone, kNone};
    double shared = 0.0;
    for (const auto& open : openings(profile, z)) {
        const double here = std::min(open.second, other.second) - std::max(open.first, other.first);
        if (!(here > shared)) continue;
        shared = here;
        most = open;
    }
    return most;
}

// Three standard deviations along the line of the place of its edges, the mean of both, or of its width: of
// the opening that is widest in the recipe's cut.
double roughness(const Recipe& recipe, bool of_width, double z, const levelset::MaterialStack& stack,
                 const TriangleMesh& surface) {
    surface::Plane plane = surface::parse_plane(recipe.metrology.cut);
    const int across = plane.normal.x() != 0.0 ? 0 : 1;
    const auto a = static_cast<std::size_t>(across);
    const levelset::Domain& domain = stack.domain;
    const std::pair<double, double> line = widest_opening(profile_of(surface, plane, domain), z);
    std::vector<double> left, right, width;
    for (int row = 0; row < domain.cells[a]; ++row) {
        const double at = domain.min[a] + (row + 0.5) * domain.spacing;
        plane.offset = at * plane.normal[across];
        const auto [from, to] = opening_over(profile_of(surface, plane, domain), z, line);
        if (!std::isfinite(to - from)) continue;
        left.push_back(from);
        right.push_back(to);
        width.push_back(to - from);
    }
    if (width.size() < 2) return kNone;
    return 3.0 * std::sqrt(of_width ? variance(width) : 0.5 * (variance(left) + variance(right)));
}

}  // namespace

// The cuts of all layers' boundaries, bottom up.
struct FigureReader::Cuts {
    const levelset::MaterialStack& stack;
    std::vector<Profile> layers;
    Profile open;  // of the surface without closed voids

    Cuts(const levelset::MaterialStack& of, const TriangleMesh& surface, const TriangleMesh& without_voids,
         const surface::Plane& plane)
        : stack(of), open(profile_of(without_voids, plane, of.domain)) {
        for (std::size_t k = 0; k + 1 < of.layers.size(); ++k)
            layers.push_back(profile_of(levelset::extract_around(of, k, plane), plane, of.domain));
        layers.push_back(profile_of(surface, plane, of.domain));
    }
    const Profile& surface() const { return layers.back(); }

    // Stretches of a line in a material; solid() finds those below one profile.
    template <class Solid>
    Stretches of_material(int material, Solid&& solid) const {
        Stretches all;
        for (std::size_t k = 0; k < layers.size(); ++k) {
            if (stack.layers[k].material != material) continue;
            const Stretches own = k == 0 ? solid(layers[0]) : without(solid(layers[k]), solid(layers[k - 1]));
            all.insert(all.end(), own.begin(), own.end());
        }
        std::sort(all.begin(), all.end());
        // Layers of one material that touch are one.
        const double touching = levelset::thinnest_film(stack.domain);
        Stretches joined;
        for (const auto& [from, to] : all)
            if (!joined.empty() && from <= joined.back().second + touching)
                joined.back().second = std::max(joined.back().second, to);
            else
                joined.emplace_back(from, to);
        return joined;
    }
};

FigureReader::FigureReader(const Recipe& recipe, const levelset::MaterialStack& stack,
                           const TriangleMesh& surface, const TriangleMesh& open)
    : recipe_(recipe), stack_(stack), surface_(surface), open_(open) {}

FigureReader::~FigureReader() = default;

const FigureReader::Cuts& FigureReader::cuts() {
    if (!cuts_)
        cuts_ = std::make_unique<const Cuts>(stack_, surface_, open_,
                                             surface::parse_plane(recipe_.metrology.cut));
    return *cuts_;
}

double FigureReader::value_of(const Figure& figure) {
    const auto level = [&](const Profile& p) { return solid_at(p, -figure.at); };
    switch (figure.kind) {
        case FigureKind::opening:  // measured with the openings, not here
        case FigureKind::without:
            break;
        case FigureKind::width:
            return widest(cuts().of_material(figure.material, level));
        case FigureKind::thickness: {
            const double along = figure.at * (cuts().surface().along.x() + cuts().surface().along.y());
            return total(
                cuts().of_material(figure.material, [&](const Profile& p) { return solid_below(p, along); }));
        }
        case FigureKind::wall:
            return on_walls(cuts(), figure.material, -figure.at);
        case FigureKind::recess:
            return recess(cuts(), figure.material);
        case FigureKind::ler:
        case FigureKind::lwr:
            return roughness(recipe_, figure.kind == FigureKind::lwr, -figure.at, stack_, open_);
        case FigureKind::volume:
            return volume(stack_, figure.material) / width_of_strip(recipe_);
    }
    return kNone;
}

Measure FigureReader::at(const Figure& figure) {
    const std::string unit =
        figure.kind == FigureKind::volume ? volume_unit(recipe_) : recipe_.domain.length_unit;
    return {figure.name, value_of(figure), unit};
}

}  // namespace sidewall::app
