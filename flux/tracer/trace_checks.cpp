#include "flux/tracer/trace_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "flux/yield.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

constexpr double kRight = std::numbers::pi / 2.0 + 1e-12;
constexpr double kMostYield = 100.0;  // largest yield, particles a hit; weights and bins can hold more

void require(bool holds, const std::string& name, const std::string& what, double value,
             const std::string& rule) {
    if (!holds) throw RecipeError("{}: {} = {}: must be {}", name, what, value, rule);
}

void check_yield(const Species& species, const Yield& yield, std::size_t materials) {
    const std::string name = species.name + " " + yield.name;
    if (yield.scale.empty() || (yield.scale.size() > 1 && yield.scale.size() < materials))
        throw RecipeError("{}: give one scale, or one a material", name);
    const auto& a = yield.coefficient;
    for (const double x : a) require(std::isfinite(x), name, "coefficient", x, "finite");
    const std::size_t least = yield.angular == Angular::table                                             ? 2
                              : yield.angular == Angular::sputter || yield.angular == Angular::polynomial ? 1
                                                                                                          : 0;
    if (a.size() < least) throw RecipeError("{}: needs {} coefficients or more", name, least);
    if (yield.angular == Angular::polynomial) {
        double sum = 0.0;
        for (const double x : a) sum += x;
        require(sum > 0.0, name, "sum of coefficients", sum, "above 0");
    }
    require(yield.threshold >= 0.0 && yield.threshold <= 1e9, name, "threshold", yield.threshold,
            "in [0, 1e9] eV");
    for (const double g : yield.energies) require(std::isfinite(g), name, "energy table", g, "finite");
    if (yield.energies.size() == 1 || (!yield.energies.empty() && !(yield.energy_top > yield.threshold)))
        throw RecipeError("{}: an energy table needs 2 values or more and a top above the threshold", name);
    double factor = 0.0;
    for (int k = 0; k <= 256; ++k) factor = std::max(factor, angular_factor(yield, k / 256.0));
    const double energy = species.energy.mean + 8.0 * species.energy.sigma;
    factor *= yield.energies.empty() ? energy_factor(yield, species.energy.mean > 0.0, energy)
                                     : *std::max_element(yield.energies.begin(), yield.energies.end());
    for (const double scale : yield.scale) {
        require(scale >= 0.0, name, "scale", scale, "at least 0");
        require(scale * factor <= kMostYield, name, "largest yield", scale * factor,
                fmt::format("at most {} a hit: scale it down", kMostYield));
    }
}

void check_species(const Species& species, const LateralBox& box, std::size_t materials) {
    const auto demand = [&](bool holds, const char* what, double value, const char* rule) {
        require(holds, species.name, what, value, rule);
    };
    demand(species.source_exponent >= 0.0 && species.source_exponent <= 1e6, "source_exponent",
           species.source_exponent, "in [0, 1e6]");
    check_sticking(species.name, species.sticking);
    const Vec3& beam = species.beam;
    if (!beam.allFinite() || std::abs(beam.norm() - 1.0) > 1e-9 || !(beam.z() < -0.01))
        throw RecipeError("{}: beam = ({:.6g}, {:.6g}, {:.6g}): must have length 1 and point downwards",
                          species.name, beam.x(), beam.y(), beam.z());
    for (int axis = 0; axis < 2; ++axis)
        if (!species.rotating && beam[axis] != 0.0 &&
            (box.axial || box.boundary[axis] == Boundary::reflective))
            throw RecipeError(
                "{}: the beam is tilted along {}, and the reflective sides there would mirror it: use "
                "periodic sides",
                species.name, "xy"[axis]);
    const Energy& energy = species.energy;
    demand(energy.mean >= 0.0 && energy.mean <= 1e9, "energy", energy.mean, "in [0, 1e9] eV");
    demand(energy.sigma >= 0.0 && energy.sigma <= energy.mean, "energy spread", energy.sigma,
           "in [0, energy] eV");
    double before = 0.0;
    for (const SourceBin& bin : species.bins) {
        demand(bin.until > before && bin.until <= 1.0, "share of a source's bin", bin.until - before,
               "above 0");
        demand(bin.angle_from >= 0.0 && bin.angle_to >= bin.angle_from && bin.angle_to < kRight - 1e-9,
               "angle of a source's bin", bin.angle_to, "in [0, pi/2)");
        demand(bin.energy_from >= 0.0 && bin.energy_to >= bin.energy_from &&
                   (bin.energy_to > 0.0) == (energy.mean > 0.0),
               "energy of a source's bin", bin.energy_to, "rising, or 0 for a species without energy");
        before = bin.until;
    }
    demand(species.source_beta >= -1.0 && species.source_beta <= 1e6, "source_beta", species.source_beta,
           "in [-1, 1e6]");
    if (species.source_beta != 0.0 && (!species.bins.empty() || species.source_exponent != 1.0))
        throw RecipeError("{}: source_beta stands for bins and source_exponent: give one of them",
                          species.name);
    demand(species.mean_free_path > 0.0, "mean_free_path", species.mean_free_path, "above 0");
    if (std::isfinite(species.mean_free_path) && (energy.mean > 0.0 || species.redeposition))
        throw RecipeError(
            "{}: mean_free_path = {}: is for species without energy and redeposition: collisions turn them thermal",
            species.name, species.mean_free_path);
    demand(species.stop_energy >= 0.0, "stop_energy", species.stop_energy, "at least 0");
    const Reflection& r = species.reflection;
    demand(r.from >= 0.0 && r.from <= kRight, "reflection from", r.from, "in [0, pi/2]");
    demand(r.to >= r.from && r.to <= kRight, "reflection to", r.to, "between `from` and pi/2");
    demand(r.cone >= 0.0 && r.cone <= kRight, "cone", r.cone, "in [0, pi/2]");
    demand(r.inflection > 0.0 && r.inflection < kRight - 1e-9, "inflection", r.inflection,
           "between 0 and pi/2");
    demand(r.exponent > 0.0 && r.exponent <= 1e3, "reflection exponent", r.exponent, "above 0, at most 1000");
    demand(r.spread >= 0.0 && r.spread <= 1.0, "energy spread of reflection", r.spread, "in [0, 1]");
    for (const Yield& yield : species.yields) check_yield(species, yield, materials);
    if (species.redeposition) {
        check_yield(species, species.redeposition->yield, materials);
        check_sticking(species.name + " redeposition", species.redeposition->sticking);
    }
}

void check_options(const TraceOptions& options) {
    if (options.rays < 1 || options.rays > 1'000'000'000'000)
        throw RecipeError("rays = {}: must be 1 to 1e12", options.rays);
    if (options.relative_error && !(*options.relative_error > 0.0))
        throw RecipeError("relative_error = {}: must be above 0", *options.relative_error);
    if (options.batches < 16 || options.batches > 65536)
        throw RecipeError("batches = {}: must be 16 to 65536", options.batches);
    if (options.task_rays < 1 || options.max_bounces < 1 || options.max_bounces > 1'000'000)
        throw RecipeError("task_rays and max_bounces must be at least 1, max_bounces at most 1000000");
    if (!(options.roulette > 0.0 && options.roulette <= 1.0))
        throw RecipeError("roulette = {}: must be above 0, at most 1", options.roulette);
}

std::vector<std::span<const double>> parts(std::span<const double> all, const char* what, std::size_t species,
                                           const Wedges& wedges) {
    std::vector<std::span<const double>> each(species);
    if (all.empty()) return each;
    if (all.size() != species * wedges.count())
        throw GeometryError(
            species == 1
                ? fmt::format("{} {} for {} wedges: give one a wedge", all.size(), what, wedges.count())
                : fmt::format("{} {} for {} species on {} wedges: give each species one "
                              "a wedge",
                              all.size(), what, species, wedges.count()));
    for (std::size_t k = 0; k < species; ++k) each[k] = all.subspan(k * wedges.count(), wedges.count());
    return each;
}

void check_one(const TriangleMesh& mesh, const LateralBox& box, const Species& species,
               std::span<const double> sticking_by_wedge, std::span<const std::int32_t> materials,
               const Wedges& wedges, const TraceOptions& options) {
    std::size_t ids = 0;
    for (const std::int32_t id : materials)
        ids = std::max(ids, static_cast<std::size_t>(std::max(id, 0)) + 1);
    check_species(species, box, ids);
    check_options(options);
    check_fit(mesh, box, wedges);
    for (const double s : sticking_by_wedge)
        require(s >= 0.0 && s <= 1.0, species.name, "sticking of a wedge", s, "in [0, 1]");
    check_materials(species, materials, mesh.triangles.size());
}

}  // namespace

void check_sticking(const std::string& name, const std::vector<double>& sticking) {
    if (sticking.empty()) throw RecipeError("{}: no sticking probability: give one, or one a material", name);
    for (const double s : sticking) require(s >= 0.0 && s <= 1.0, name, "sticking", s, "in [0, 1]");
}

void check_materials(const Species& species, std::span<const std::int32_t> materials, std::size_t triangles) {
    if (materials.empty()) return;
    if (materials.size() != triangles)
        throw GeometryError("{} materials for {} triangles: give one a triangle", materials.size(),
                            triangles);
    const auto missing = [&](const std::vector<double>& by_material, std::int32_t id) {
        return by_material.size() > 1 && static_cast<std::size_t>(id) >= by_material.size();
    };
    for (std::size_t t = 0; t < materials.size(); ++t)
        if (materials[t] < 0 || missing(species.sticking, materials[t]) ||
            (species.redeposition && missing(species.redeposition->sticking, materials[t])))
            throw RecipeError("{}: triangle {} is of material {}, which has no sticking probability",
                              species.name, t, materials[t]);
}

void check_fit(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges) {
    if (!(box.area() > 0.0)) throw GeometryError("the lateral box has no area: take it from lateral_box");
    if (wedges.corner.size() != 3 * mesh.triangles.size() || wedges.first.size() != mesh.vertices.size() + 1)
        throw GeometryError("the wedges belong to another mesh: make them anew after the mesh changed");
}

WedgeValues check(const TriangleMesh& mesh, const LateralBox& box, std::span<const Species> species,
                  std::span<const std::int32_t> materials, const Wedges& wedges,
                  const TraceOptions& options) {
    constexpr double kMostEmission = 1e9;  // of the plane's flux; above, rounding hides the plane's part
    WedgeValues values{parts(options.sticking_by_wedge, "sticking probabilities", species.size(), wedges),
                       parts(options.emission_by_wedge, "emissions", species.size(), wedges)};
    for (std::size_t k = 0; k < species.size(); ++k) {
        for (const double emission : values.emission[k])
            require(emission >= 0.0 && emission <= kMostEmission, species[k].name, "emission of a wedge",
                    emission, "in [0, 1e9] of the plane's flux");
        check_one(mesh, box, species[k], values.sticking[k], materials, wedges, options);
    }
    return values;
}

}  // namespace sidewall::flux
