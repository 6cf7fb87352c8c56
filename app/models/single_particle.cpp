#include <algorithm>

#include "app/models/gas_keys.hpp"

namespace sidewall::app {
namespace {

// V = rate(material) * flux of one neutral that sticks or is re-emitted diffusely.
Model make_single_particle(const Values& values, const Materials& materials) {
    const std::vector<double> rate = by_material_id(values.get<ByMaterial>("rate"), materials);
    Model model;
    model.species = {{"neutral", values.get<double>("source_exponent"),
                      by_material_id(values.get<ByMaterial>("sticking"), materials)}};
    add_gas(values, "", model);
    model.deposit = film(values, materials, *std::max_element(rate.begin(), rate.end()) > 0.0);
    model.speed = [rate](const SurfacePoint& point) {
        return rate[static_cast<std::size_t>(point.material)] * point.flux[0];
    };
    return model;
}

}  // namespace

ModelEntry single_particle() {
    std::vector<Key> keys = {
        {"rate", ByMaterial{}, "length/time",
         "speed at flux 1, an open flat wafer's; positive grows, negative etches; 0 for materials a table leaves out",
         required()},
        {"sticking", ByMaterial{1.0}, "", "probability that a hit sticks; else it is re-emitted diffusely",
         kProbability},
        {"source_exponent",
         1.0,
         "",
         "n of the source's cos^n; 1 is a thermal gas",
         {.min = 0.0, .max = 1e6}}};
    for (Key& key : gas_keys()) keys.push_back(std::move(key));
    keys.push_back(deposit_key());
    return {"single_particle", "one neutral species: V = rate * flux", std::move(keys), make_single_particle};
}

}  // namespace sidewall::app
