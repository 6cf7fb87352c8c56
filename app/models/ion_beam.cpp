#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/models/particles.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

// Tallies of the beam, in the order of flux_names.
enum Tally : std::size_t { kIons, kSputter, kRedeposited };

// Atoms in 1e22 /cm^3. No solid has more (diamond: 17.6); a larger density marks an ideal mask.
constexpr double kDensest = 20.0;

struct IonBeam {
    ByMaterial rate;
    double tilt_deg = 0.0, azimuth_deg = 0.0;
    bool rotating = false;
    double threshold = 20.0;
    std::vector<double> yield{10.3, 0.0, -9.3}, yield_table;
    double redeposition_fraction = 0.0, redeposition_rate = 0.0;
    ByMaterial redeposition_sticking{1.0};
    std::string deposit;
    Ions ions{.ion_exponent = 1000.0};
};

std::vector<Key> ion_beam_keys(IonBeam& p) {
    std::vector<Key> list = {
        {"rate", &p.rate, "length/time",
         "etch rate of a flat wafer under this beam; 0 for materials a table leaves out",
         required(kNotNegative)},
        {"tilt_deg", &p.tilt_deg, "degree", "angle of the beam from the wafer's normal", within(0.0, 85.0)},
        {"azimuth_deg", &p.azimuth_deg, "degree", "0: the beam flies towards +x; 90: towards +y",
         within(-360.0, 360.0)},
        {"rotating", &p.rotating, "", "the wafer turns, so that the beam comes from all azimuths equally"},
        {"threshold", &p.threshold, "eV", "E_th: ion energy below which nothing is sputtered", kNotNegative},
        {"yield",
         &p.yield,
         "",
         "coefficients a_1, a_2, ... of the yield Y = sum a_k cos^k theta / sum a_k at the angle of "
         "incidence theta; the default is (1 + 9.3 sin^2 theta) cos theta",
         {.required = false}},
        {"yield_table", &p.yield_table, "",
         "Y at equally spaced angles of incidence from 0 to 90 degrees, linear in between; takes the place "
         "of yield"},
        {"redeposition_fraction", &p.redeposition_fraction, "",
         "fraction of the sputtered atoms that fly off about the ions' mirrored direction; those that "
         "stick where they land grow the film, atom for atom by the materials' densities. An ideal mask, "
         "denser than 20, counts volume for volume; 0: no redeposition",
         kProbability},
        {"redeposition_rate", &p.redeposition_rate, "length/time",
         "instead of redeposition_fraction: growth rate of the film at a redeposited flux of 1 (yield 1) "
         "that sticks, however much the beam removes; 0: no redeposition",
         kNotNegative},
        {"redeposition_sticking", &p.redeposition_sticking, "", "sticking probability of sputtered material",
         kProbability},
        deposit_key(p.deposit),
    };
    append_keys(list, ion_keys(p.ions));
    return list;
}

// Etch rates and densities by material, for the balance between sputtered and redeposited atoms.
struct Redeposited {
    std::vector<double> rate;        // etch rate of a flat wafer, length/time
    std::vector<double> atoms;       // 1e22 /cm^3; an ideal mask counts with the film's: equal volumes
    double film_atoms = 0.0;         // density of the film, 1e22 /cm^3
    double flat = 0.0;               // mean yield on a flat wafer
    double most = 0.0;               // largest product of rate and atoms
    std::vector<double> sticking{};  // sticking probability of redeposited particles
};

Redeposited balance(const Materials& materials, int film_id, const std::vector<double>& rate, double flat) {
    Redeposited parts{rate, densities(materials), materials[static_cast<std::size_t>(film_id)].density, flat};
    for (std::size_t m = 0; m < rate.size(); ++m) {
        if (parts.atoms[m] > kDensest) parts.atoms[m] = parts.film_atoms;
        parts.most = std::max(parts.most, rate[m] * parts.atoms[m]);
    }
    return parts;
}

void check_film(const IonBeam& p, const Redeposited& parts) {
    const std::string& name = p.deposit;
    if (parts.film_atoms > kDensest)
        throw KeyError(
            "deposit",
            fmt::format("{:g}e22 atoms per cm^3 make an ideal mask and no film: name what the beam "
                        "sputters, or give {} its own density by a [[material]]",
                        parts.film_atoms, name));
    // The beam etches the film as well: with a rate of 0 by default the film would shield the wafer for ever.
    if (!p.rate.named.contains(name) && p.rate.fallback.value_or(0.0) == 0.0)
        throw KeyError(
            "rate", fmt::format("has no value for {0}, the film that redeposits, which the beam etches, too: "
                                "add {0} = {1:.4g}, which sputters as many atoms, or what was measured",
                                name, parts.most / parts.film_atoms));
}

// Notes on materials where redeposition_rate times a hit's yield exceeds what the material loses by the hit.
std::vector<std::string> notes_on_rate(const Materials& materials, const Redeposited& parts, double growth) {
    constexpr double kRounding = 1e-6;
    std::vector<std::string> notes(materials.size());
    for (std::size_t m = 0; m < notes.size(); ++m) {
        const double left = parts.rate[m] * parts.atoms[m] / parts.flat, down = growth * parts.film_atoms;
        if (down <= (1.0 + kRounding) * left) continue;
        notes[m] = fmt::format(
            "redeposition_rate creates matter: where the beam hits {}, {}; redeposition_fraction = 1 "
            "redeposits as many atoms as are sputtered, and no more",
            materials[m].name,
            left > 0.0 ? fmt::format("{:.3g} atoms redeposit for each that is sputtered", down / left)
                       : "atoms redeposit and none are sputtered");
    }
    return notes;
}

// Scale of the redeposition yield by material, in units of the most that any material emits on a flat wafer,
// so that the tracer's weights are about 1.
std::vector<double> redeposition_scale(const Redeposited& parts, double fraction) {
    std::vector<double> scale(parts.rate.size(), 0.0);
    for (std::size_t m = 0; m < scale.size() && parts.most > 0.0; ++m)
        scale[m] = fraction * parts.rate[m] * parts.atoms[m] / (parts.most * parts.flat);
    return scale;
}

// Speed that conserves atoms: a net gain grows the film by atoms over its density; a net loss etches the
// material at the point by atoms over that material's density.
double balanced_speed(const Redeposited& parts, const SurfacePoint& point) {
    const auto m = static_cast<std::size_t>(point.material);
    const double atoms = parts.most * parts.sticking[m] * point.flux[kRedeposited] -
                         parts.atoms[m] * parts.rate[m] * point.flux[kSputter] / parts.flat;
    return atoms / (atoms > 0.0 ? parts.film_atoms : parts.atoms[m]);
}

flux::Species beam_species(const IonBeam& p) {
    const std::vector<double>&coefficients = p.yield, &table = p.yield_table;
    double sum = 0.0;
    for (const double a : coefficients) sum += a;
    if (table.size() == 1)
        throw KeyError("yield_table", "must have 2 values or more: Y at 0 and at 90 degrees");
    for (const double y : table)
        if (!(y >= 0.0)) throw KeyError("yield_table", "must not be negative");
    if (table.empty() && !(std::abs(sum) > 1e-9))
        throw KeyError("yield", "must not add up to 0: Y is 1 at normal incidence");
    if (p.threshold >= p.ions.energy) throw KeyError("threshold", "must be below energy, or nothing etches");

    flux::Species ion =
        ion_species(p.ions, {{"sputter",
                              table.empty() ? flux::Angular::polynomial : flux::Angular::table,
                              p.threshold,
                              {1.0},
                              table.empty() ? coefficients : table}});
    ion.beam = tilted_beam(p.tilt_deg, p.azimuth_deg);
    ion.rotating = p.rotating;
    return ion;
}

// V = -rate * yield-weighted flux / its mean on a flat wafer + redeposition: with redeposition_fraction by
// balanced_speed, with redeposition_rate that rate times the sticking and the redeposited flux.
Model make_ion_beam(const IonBeam& p, const Materials& materials) {
    const std::vector<double> rate = by_material_id(p.rate, materials);
    flux::Species ion = beam_species(p);
    const double flat = flux::mean_yield(ion, ion.yields[0]);
    if (!(flat > 0.0)) throw KeyError("yield", "must be positive at the incidence tilt_deg");
    const double growth = p.redeposition_rate, fraction = p.redeposition_fraction;
    if (growth > 0.0 && fraction > 0.0)
        throw KeyError("redeposition_rate", "takes the place of redeposition_fraction; drop one of the two");

    Model model;
    const bool comes_down = growth > 0.0 || fraction > 0.0;
    if (comes_down && p.deposit.empty())
        throw KeyError("deposit", "missing: what redeposits is a film; name it, e.g. deposit = \"Si\"");
    if (comes_down) model.deposit = film(p.deposit, materials, true);
    const std::vector<double> sticking = by_material_id(p.redeposition_sticking, materials);
    if (model.deposit)
        ion.redeposition = flux::Redeposition{ion.yields[0], flux::Reemission::coned, sticking};
    if (fraction > 0.0) {
        Redeposited parts = balance(materials, *model.deposit, rate, flat);
        check_film(p, parts);
        ion.redeposition->yield.scale = redeposition_scale(parts, fraction);
        parts.sticking = sticking;
        model.speed = [parts = std::move(parts)](const SurfacePoint& point) {
            return balanced_speed(parts, point);
        };
    } else {
        if (growth > 0.0)
            model.notes = notes_on_rate(materials, balance(materials, *model.deposit, rate, flat), growth);
        model.speed = [=](const SurfacePoint& point) {
            const auto m = static_cast<std::size_t>(point.material);
            const double etch = rate[m] * point.flux[kSputter] / flat;
            return (growth > 0.0 ? growth * sticking[m] * point.flux[kRedeposited] : 0.0) - etch;
        };
    }
    model.species = {std::move(ion)};
    return model;
}

}  // namespace

ModelEntry ion_beam() {
    return model_entry(
        "ion_beam", "ion-beam etching: V = -rate * yield-weighted flux, with a tilted beam and redeposition",
        ion_beam_keys, make_ion_beam);
}

}  // namespace sidewall::app
