#include <algorithm>
#include <cmath>

#include "app/models/model.hpp"

namespace sidewall::app {
namespace {

struct Isotropic {
    ByMaterial rate;
    std::string deposit;
};

std::vector<Key> isotropic_keys(Isotropic& p) {
    return {{"rate", &p.rate, "length/time",
             "speed of the surface: positive grows, negative etches; 0 for materials a table leaves out",
             required()},
            deposit_key(p.deposit)};
}

// V = rate(material): wet etching of amorphous films, conformal deposition.
Model make_isotropic(const Isotropic& p, const Materials& materials) {
    const std::vector<double> rate = by_material_id(p.rate, materials);
    const auto [low, high] = std::minmax_element(rate.begin(), rate.end());
    Model model;
    model.deposit = film(p.deposit, materials, *high > 0.0);
    model.hints.max_speed = std::max(std::abs(*low), std::abs(*high));
    for (const double v : rate) model.hints.inert.push_back(v == 0.0);
    model.speed = [rate](const SurfacePoint& point) {
        return rate[static_cast<std::size_t>(point.material)];
    };
    return model;
}

}  // namespace

ModelEntry isotropic() {
    return model_entry("isotropic", "the same speed in every direction: V = rate", isotropic_keys,
                       make_isotropic);
}

}  // namespace sidewall::app
