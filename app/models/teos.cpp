#include <algorithm>
#include <cmath>

#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

struct Precursor {
    double rate = 1.0;
    ByMaterial sticking{0.1};
    double order = 1.0;
    Gas gas;
};

struct Teos {
    std::vector<Precursor> precursors;
    std::string deposit;
};

std::vector<Key> precursor_keys(Precursor& p) {
    std::vector<Key> keys = {
        {"rate", &p.rate, "length/time", "growth rate at flux 1, which an open flat wafer receives",
         required(kNotNegative)},
        {"sticking", &p.sticking, "",
         "s: sticking probability at flux 1; what does not stick is re-emitted diffusely", kProbability},
        {"order", &p.order, "",
         "m: order of the reaction in this precursor; sticking is s * min(flux, 1)^(m - 1)",
         within(1.0, 5.0)},
    };
    append_keys(keys, gas_keys(p.gas));
    return keys;
}

std::vector<Key> teos_keys(Teos& p) {
    return {{"precursors", table_list(p.precursors, precursor_keys), "", "the precursors, one or two",
             required()},
            deposit_key(p.deposit)};
}

// V = sum of rate flux^order over one or two precursors. Each sticks with probability s theta^(order - 1),
// where theta is its flux, at most 1.
Model make_teos(const Teos& p, const Materials& materials) {
    const std::vector<Precursor>& precursors = p.precursors;
    if (precursors.size() > 2) throw KeyError("precursors", "must be one or two");
    Model model;
    for (std::size_t k = 0; k < precursors.size(); ++k) {
        const std::string name = precursors.size() == 1 ? "precursor"
                                 : k == 0               ? "precursor_1"
                                                        : "precursor_2";
        model.species.push_back({name, 1.0, by_material_id(precursors[k].sticking, materials)});
        model.species_keys.push_back("precursors[" + std::to_string(k) + "].");
        add_gas(precursors[k].gas, model.species_keys.back(), model);
        model.coverages.names.push_back(name);
    }
    model.deposit = film(p.deposit, materials, true);
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
    return model_entry("teos",
                       "chemical vapour deposition from one or two precursors: V = sum of rate * flux^order",
                       teos_keys, make_teos);
}

}  // namespace sidewall::app
