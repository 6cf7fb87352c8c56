#include <algorithm>
#include <cmath>

#include "app/models/gas_keys.hpp"

namespace sidewall::app {
namespace {

// V = sum of rate flux^order over one or two precursors; each sticks with s theta^(order - 1), theta its
// flux, at most 1.
Model make_teos(const Values& values, const Materials& materials) {
    struct Precursor {
        double rate, order;
    };
    const auto& list = values.get<std::vector<Values>>("precursors");
    if (list.size() > 2) throw KeyError("precursors", "must be one or two");
    Model model;
    std::vector<Precursor> precursors;
    for (std::size_t k = 0; k < list.size(); ++k) {
        precursors.push_back({list[k].get<double>("rate"), list[k].get<double>("order")});
        const std::string name = list.size() == 1 ? "precursor" : k == 0 ? "precursor_1" : "precursor_2";
        model.species.push_back({name, 1.0, by_material_id(list[k].get<ByMaterial>("sticking"), materials)});
        model.species_keys.push_back("precursors[" + std::to_string(k) + "].");
        add_gas(list[k], model.species_keys.back(), model);
        model.coverages.names.push_back(name);
    }
    model.deposit = film(values, materials, true);
    model.coverages.react = [](const SurfacePoint& point, double, std::span<double> theta) {
        for (std::size_t k = 0; k < theta.size(); ++k) theta[k] = std::clamp(point.flux[k], 0.0, 1.0);
    };
    model.sticking = [precursors, species = model.species](std::size_t k, const SurfacePoint& point) {
        const double s = species[k].sticking[static_cast<std::size_t>(point.material)];
        return s * std::pow(point.coverage[k], precursors[k].order - 1.0);
    };
    model.speed = [precursors](const SurfacePoint& point) {
        double speed = 0.0;
        for (std::size_t k = 0; k < precursors.size(); ++k)
            speed += precursors[k].rate * std::pow(std::max(0.0, point.flux[k]), precursors[k].order);
        return speed;
    };
    return model;
}

}  // namespace

ModelEntry teos() {
    std::vector<Key> precursor = {
        {"rate", 1.0, "length/time", "growth at flux 1", required(kNotNegative)},
        {"sticking", ByMaterial{0.1}, "", "s; what does not stick is re-emitted diffusely", kProbability},
        {"order", 1.0, "", "m, the reaction's order in this precursor", {.min = 1.0, .max = 5.0}},
    };
    for (Key& key : gas_keys()) precursor.push_back(std::move(key));
    return {"teos",
            "chemical vapour deposition from one or two precursors: V = sum of rate * flux^order",
            {{"precursors", std::vector<Values>(), "", "one or two", {.required = true, .keys = precursor}},
             deposit_key()},
            make_teos};
}

}  // namespace sidewall::app
