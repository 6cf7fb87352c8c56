#include <algorithm>
#include <cmath>

#include "app/models/model.hpp"
#include "levelset/motion/advection.hpp"

namespace sidewall::app {
namespace {

struct Directional {
    ByMaterial directional, isotropic;
    std::vector<double> direction{0.0, 0.0, 1.0};
    bool visibility = true;
    std::string deposit;
};

std::vector<Key> directional_keys(Directional& p) {
    return {{"directional", &p.directional, "length/time",
             "speed of a surface that faces the source, negative where it etches; 0 for materials a table "
             "leaves out",
             required()},
            {"isotropic", &p.isotropic, "length/time",
             "speed of every surface, whatever its direction, in addition; 0 for materials a table leaves "
             "out"},
            {"direction", &p.direction, "", "d: vector from the surface towards the source", sized(3)},
            {"visibility", &p.visibility, "", "whether structures between a point and the source shadow it"},
            deposit_key(p.deposit)};
}

// V = directional max(0, n.d) [visible] + isotropic, d towards the source: a beam and a chemical part.
Model make_directional(const Directional& p, const Materials& materials) {
    const std::vector<double> beam = by_material_id(p.directional, materials);
    const std::vector<double> chemical = by_material_id(p.isotropic, materials);
    const std::vector<double>& d = p.direction;
    const double length = std::hypot(d[0], d[1], d[2]);
    if (!(d[2] > 0.0))
        throw KeyError("direction",
                       "points from the surface towards the source: its third number must be positive");
    const Vec3 towards = Vec3(d[0], d[1], d[2]) / length;

    Model model;
    double bound = 0.0;
    bool grows = false;
    for (std::size_t m = 0; m < materials.size(); ++m) {
        // n.d takes every value in [0, 1], so |V| is largest at 0 or at 1.
        bound = std::max({bound, std::abs(chemical[m]), std::abs(beam[m] + chemical[m])});
        grows = grows || chemical[m] > 0.0 || beam[m] + chemical[m] > 0.0;
        model.hints.inert.push_back(beam[m] == 0.0 && chemical[m] == 0.0);
    }
    model.deposit = film(p.deposit, materials, grows);
    model.hints.max_speed = bound;
    model.depends_on_normal = true;
    model.beam = towards;
    if (p.visibility) model.visibility = towards;
    model.speed = [beam, chemical, towards](const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        const double facing = point.visible ? std::max(0.0, point.normal.dot(towards)) : 0.0;
        return beam[m] * facing + chemical[m];
    };
    model.hints.beam_speed = [beam, chemical](const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        return levelset::BeamSpeed{point.visible ? beam[m] : 0.0, chemical[m]};
    };
    model.hints.max_etch_rate = [beam, chemical](const SurfacePoint& point) {
        // V is linear in n.d, so its extremes are at n.d = 0 and 1; only 0 occurs in the shadow.
        const auto m = static_cast<std::size_t>(point.material);
        const double facing = point.visible ? beam[m] + chemical[m] : chemical[m];
        return std::max({0.0, -chemical[m], -facing});
    };
    return model;
}

}  // namespace

ModelEntry directional() {
    return model_entry(
        "directional",
        "a parallel beam plus an isotropic part: V = directional * max(0, n.d) (0 in the shadow) + "
        "isotropic",
        directional_keys, make_directional);
}

}  // namespace sidewall::app
