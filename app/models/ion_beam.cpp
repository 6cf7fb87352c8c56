#include <cmath>

#include "app/models/ions.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

// Tallies of the one species.
enum Tally : std::size_t { kIon, kSputter, kRedeposited };

// V = -rate * yield-weighted flux / its mean on a flat wafer + redeposition_rate * redeposited weight.
Model make(const Values& values, const Materials& materials) {
    const auto number = [&](const char* key) { return values.get<double>(key); };
    const std::vector<double> rate = by_material_id(values.get<ByMaterial>("rate"), materials);
    const auto& coefficients = values.get<std::vector<double>>("yield");
    const auto& table = values.get<std::vector<double>>("yield_table");
    double sum = 0.0;
    for (const double a : coefficients) sum += a;
    if (table.size() == 1)
        throw KeyError("yield_table", "must have 2 values or more: Y at 0 and at 90 degrees");
    for (const double y : table)
        if (!(y >= 0.0)) throw KeyError("yield_table", "must not be negative");
    if (table.empty() && !(std::abs(sum) > 1e-9))
        throw KeyError("yield", "must not add up to 0: Y is 1 at normal incidence");
    const double threshold = number("threshold"), energy = number("energy");
    if (threshold >= energy) throw KeyError("threshold", "must be below energy, or nothing etches");

    Model model;
    flux::Species ion = ion_species(values, threshold);
    ion.beam = tilted_beam(number("tilt_deg"), number("azimuth_deg"));
    ion.rotating = values.get<bool>("rotating");
    ion.yields = {{"sputter",
                   table.empty() ? flux::Angular::polynomial : flux::Angular::table,
                   threshold,
                   {1.0},
                   table.empty() ? coefficients : table}};
    const double flat = flux::mean_yield(ion, ion.yields[0]);
    if (!(flat > 0.0)) throw KeyError("yield", "must be positive at the incidence tilt_deg");
    const double redeposition = number("redeposition_rate");
    if (redeposition > 0.0)
        ion.redeposition =
            flux::Redeposition{ion.yields[0], flux::Reemission::coned,
                               by_material_id(values.get<ByMaterial>("redeposition_sticking"), materials)};
    model.species = {std::move(ion)};
    model.deposit = film(values, materials, redeposition > 0.0);
    model.speed = [=](const SurfacePoint& point) {
        const double etch = rate[static_cast<std::size_t>(point.material)] * point.flux[kSputter] / flat;
        return (redeposition > 0.0 ? redeposition * point.flux[kRedeposited] : 0.0) - etch;
    };
    return model;
}

std::vector<Key> keys() {
    std::vector<Key> list = {
        {"rate", ByMaterial{}, "length/time",
         "etch rate of a flat wafer under this beam; 0 for materials a table leaves out",
         required(kNotNegative)},
        {"tilt_deg", 0.0, "degree", "of the beam from the wafer's normal", {.min = 0.0, .max = 85.0}},
        {"azimuth_deg",
         0.0,
         "degree",
         "0: the beam flies towards +x; 90: towards +y",
         {.min = -360.0, .max = 360.0}},
        {"rotating", false, "", "the wafer turns: every azimuth is as likely"},
        {"threshold", 20.0, "eV", "E_th below which nothing is sputtered", kNotNegative},
        {"yield",
         std::vector<double>{10.3, 0.0, -9.3},
         "",
         "a_k of Y = sum a_k cos^k / sum a_k, k from 1; the default is (1 + 9.3 sin^2) cos",
         {.required = false}},
        {"yield_table", std::vector<double>{}, "",
         "Y at equal steps of the incidence from 0 to 90 degrees, linear in between; takes the place of yield"},
        {"redeposition_rate", 0.0, "length/time",
         "growth where sputtered material lands, at weight 1; 0: none", kNotNegative},
        {"redeposition_sticking", ByMaterial{1.0}, "", "of sputtered material", kProbability},
        deposit_key(),
    };
    for (Key& key : ion_keys(1000.0)) list.push_back(std::move(key));
    return list;
}

}  // namespace

ModelEntry ion_beam() {
    return {"ion_beam",
            "ion-beam etching: V = -rate * yield-weighted flux, with a tilted beam and what redeposits",
            keys(), make};
}

}  // namespace sidewall::app
