#include <algorithm>

#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

struct SingleParticle {
    ByMaterial rate, sticking{1.0};
    double source_exponent = 1.0;
    Gas gas;
    std::string deposit;
};

std::vector<Key> single_particle_keys(SingleParticle& p) {
    std::vector<Key> keys = {
        {"rate", &p.rate, "length/time",
         "speed at flux 1, which an open flat wafer receives; positive grows, negative etches; 0 for "
         "materials a table leaves out",
         required()},
        {"sticking", &p.sticking, "", "probability that a hit sticks; else it is re-emitted diffusely",
         kProbability},
        {"source_exponent", &p.source_exponent, "",
         "n of the source's angular distribution cos^n; 1 is a thermal gas", within(0.0, 1e6)}};
    append_keys(keys, gas_keys(p.gas));
    keys.push_back(deposit_key(p.deposit));
    return keys;
}

// V = rate(material) * flux of one neutral that sticks or is re-emitted diffusely.
Model make_single_particle(const SingleParticle& p, const Materials& materials) {
    const std::vector<double> rate = by_material_id(p.rate, materials);
    Model model;
    model.species = {{"neutral", p.source_exponent, by_material_id(p.sticking, materials)}};
    add_gas(p.gas, "", model);
    model.deposit = film(p.deposit, materials, *std::max_element(rate.begin(), rate.end()) > 0.0);
    model.speed = [rate](const SurfacePoint& point) {
        return rate[static_cast<std::size_t>(point.material)] * point.flux[0];
    };
    return model;
}

}  // namespace

ModelEntry single_particle() {
    return model_entry("single_particle", "one neutral species: V = rate * flux", single_particle_keys,
                       make_single_particle);
}

}  // namespace sidewall::app
