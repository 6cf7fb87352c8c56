#include "app/results/metrology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "app/recipe/flat.hpp"
#include "app/results/cut_profile.hpp"
#include "app/results/figure_values.hpp"
#include "app/results/film.hpp"
#include "app/results/scallops.hpp"
#include "app/results/voids.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/motion/geometric.hpp"

namespace sidewall::app {
namespace {

// The narrowest opening within two grid spacings above the mask's bottom: the mask's own, where its lower
// edge is worn, too.
double mask_opening(const Profile& profile, double bottom, double spacing) {
    constexpr int kSamples = 16;
    double narrowest = std::numeric_limits<double>::quiet_NaN();
    for (int k = 1; k <= kSamples; ++k)
        narrowest = std::fmin(narrowest, opening(profile, bottom + 2.0 * spacing * k / kSamples));
    return narrowest;
}

double lowest(const Profile& profile) {
    double z = std::numeric_limits<double>::infinity();
    profile.each_segment([&](const Vec3& p, const Vec3& q) { z = std::min({z, p.z(), q.z()}); });
    return z;
}

// Openings at equal distances from z = 0 down to the floor, none of them at the ends.
struct Wall {
    double step = 0.0;
    std::vector<double> opening;  // number k lies (k + 1/2) step below z = 0
};

Wall wall(const Profile& profile, double depth, double spacing) {
    Wall result;
    if (!(depth > 2.0 * spacing)) return result;
    const int count = static_cast<int>(std::ceil(4.0 * depth / spacing));
    result.step = depth / count;
    for (int k = 0; k < count; ++k) result.opening.push_back(opening(profile, -(k + 0.5) * result.step));
    return result;
}

// Least squares of the half opening over z; NaNs do not count.
double sidewall_angle(const Wall& wall) {
    double n = 0.0, sz = 0.0, sw = 0.0, szz = 0.0, szw = 0.0;
    for (std::size_t k = wall.opening.size() / 4; k < 3 * wall.opening.size() / 4; ++k) {
        const double z = -(static_cast<double>(k) + 0.5) * wall.step, w = 0.5 * wall.opening[k];
        if (!std::isfinite(w)) continue;
        n += 1.0;
        sz += z;
        sw += w;
        szz += z * z;
        szw += z * w;
    }
    const double spread = n * szz - sz * sz;
    if (!(n >= 3.0 && spread > 0.0)) return kNone;
    return std::atan2(1.0, (n * szw - sz * sw) / spread) * 180.0 / std::numbers::pi;
}

// The wafer without a material; nothing if it has none of it but its substrate.
std::optional<levelset::MaterialStack> stripped(const levelset::MaterialStack& stack, int material) {
    const std::vector<int> there = layer_materials(stack);
    if (there.front() == material || std::find(there.begin(), there.end(), material) == there.end())
        return std::nullopt;
    levelset::MaterialStack bare = levelset::on_one_level(stack);
    levelset::strip(bare, material);
    return bare;
}

// What measures have in common, each found once for those who ask.
class Metrologist {
  public:
    Metrologist(const Recipe& recipe, const MetrologySection& section, const levelset::MaterialStack& stack,
                const TriangleMesh& mesh)
        : recipe_(recipe),
          section_(section),
          stack_(stack),
          mesh_(mesh),
          plane_(surface::parse_plane(section.cut)) {}

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
                    add(fmt::format("cd_at_{:g}", at), opening(open(), -at));
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

    // The profile of what is open: closed voids are no openings.
    const Profile& open() {
        if (!open_) open_ = profile_of(open_mesh(), plane_, stack_.domain);
        return *open_;
    }
    const TriangleMesh& open_mesh() {
        if (!open_mesh_) open_mesh_ = open_surface(mesh_, pieces(), stack_.domain);
        return *open_mesh_ ? **open_mesh_ : mesh_;
    }
    const std::vector<levelset::SurfacePiece>& pieces() {
        if (!pieces_) pieces_ = levelset::surface_pieces(mesh_, stack_.domain);
        return *pieces_;
    }
    // The profile of the layer below the uppermost one.
    const Profile& below() {
        if (!below_)
            below_ = profile_of(levelset::extract_around(stack_, stack_.layers.size() - 2, plane_), plane_,
                                stack_.domain);
        return *below_;
    }
    double depth() {
        const double floor = lowest(open());
        return std::isfinite(floor) ? -floor : kNone;
    }
    const Wall& openings() {
        if (!openings_) openings_ = wall(open(), depth(), stack_.domain.spacing);
        return *openings_;
    }

    void add_named(const Figure& figure) {
        if (figure.kind == FigureKind::opening) {
            add(figure.name, opening(open(), -figure.at));
        } else if (figure.kind == FigureKind::without) {
            if (stripped_ != figure.stripped) {
                bare_ = stripped(stack_, figure.stripped);
                if (bare_) bare_surface_ = levelset::extract_surface(*bare_);
                stripped_ = figure.stripped;
            }
            const Measure bare = bare_ ? measure_named(recipe_, figure.of, *bare_, bare_surface_)
                                       : measure_named(recipe_, figure.of, stack_, mesh_);
            measures_.push_back({figure.name, bare.value, bare.unit});
        } else {
            if (!figures_) figures_.emplace(recipe_, stack_, mesh_, open_mesh());
            measures_.push_back(figures_->at(figure));
        }
    }
    void add_shape(const std::string& what) {
        const double dx = stack_.domain.spacing;
        if (what == "depth") {
            add(what, depth());
        } else if (what == "sidewall_angle") {
            measures_.push_back({what, sidewall_angle(openings()), "degree"});
        } else if (what == "bow") {
            double widest = kNone;
            for (const double w : openings().opening) widest = std::fmax(widest, w);
            add(what, widest - opening(open(), -dx));
        } else if (what == "undercut") {
            const double z = section_.mask_bottom;
            add(what, 0.5 * (opening(open(), z - dx) - mask_opening(open(), z, dx)));
        } else if (what == "aspect_ratio") {
            add_pure(what, depth() / opening(open(), -0.5 * depth()));
        } else if (what == "seam_depth") {
            add(what, stack_.layers.size() > 1 ? seam_depth(open(), below()) : kNone);
        }
    }
    void add_scallops() {
        const Scallops found = scallops(openings().opening, openings().step, stack_.domain.spacing);
        add("scallop_pitch", found.pitch);
        add("scallop_depth", found.depth);
    }
    void add_voids() {
        const Voids found = voids_in(mesh_, pieces(), stack_.domain, surface::plane_axes(plane_)[0]);
        add_pure("voids", found.count);
        const double strip = width_of_strip(recipe_);
        const std::string unit = volume_unit(recipe_);
        measures_.push_back({"void_volume", found.volume / strip, unit});
        measures_.push_back({"void_volume_whole", found.whole_volume / strip, unit});
        add("void_top", -found.top);
        add("void_width", found.width);
    }
    void add_film() {
        const double dx = stack_.domain.spacing;
        Film t;
        if (stack_.layers.size() > 1) t = film_between(profile_of(mesh_, plane_, stack_.domain), below(), dx);
        add("film_top", t.top);
        add("film_side", t.side);
        add("film_bottom", t.bottom);
        add_pure("step_coverage_side", t.coverage(t.side, dx));
        add_pure("step_coverage_bottom", t.coverage(t.bottom, dx));
    }

    const Recipe& recipe_;
    const MetrologySection& section_;
    const levelset::MaterialStack& stack_;
    const TriangleMesh& mesh_;
    surface::Plane plane_;
    std::optional<FigureReader> figures_;
    std::optional<std::vector<levelset::SurfacePiece>> pieces_;
    std::optional<std::optional<TriangleMesh>> open_mesh_;  // without voids; nothing inside if there are none
    std::optional<Profile> open_, below_;
    std::optional<Wall> openings_;
    int stripped_ = -1;                            // the last material that was stripped
    std::optional<levelset::MaterialStack> bare_;  // without it; nothing if it was not there
    TriangleMesh bare_surface_;
    std::vector<Measure> measures_;
};

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
        const TriangleMesh mesh = levelset::extract_surface(stack, k);
        double volume = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            volume += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
        volumes.push_back(volume - below);
        below = volume;
    }
    return volumes;
}

}  // namespace sidewall::app
