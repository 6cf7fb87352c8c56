#pragma once
#include <any>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/schema/keys.hpp"
#include "app/schema/units.hpp"
#include "flux/direct.hpp"
#include "flux/species.hpp"
#include "surface/vec3.hpp"

namespace sidewall::levelset {
struct MaterialStack;
struct BeamSpeed;
struct Shape;
}  // namespace sidewall::levelset

namespace sidewall::app {

struct GeometricStep;

/// What a model sees of a point on the surface.
struct SurfacePoint {
    int material = 0;  ///< id of the material under the point
    /// Every tally of every species in turn (flux::tally_names), relative to an open flat plane: arrivals
    /// there are 1, yields the mean yield of a hit.
    std::span<const double> flux;
    Vec3 normal = Vec3::UnitZ();  ///< unit, out of the material
    bool visible = true;  ///< the source is in line of sight; only asked where Model::visibility is set
    std::span<const double> coverage = {};  ///< as Model::coverages names them
    Vec3 position = Vec3::Zero();           ///< lengths; only where Model::depends_on_position is set
    double time = 0.0;                      ///< since the step began
};

/// Adsorbates on the surface as fractions of its sites, and their kinetics. Coverages are carried from one time step's
/// surface to the next; fluxes and coverages depend on each other through sticking.
struct Coverages {
    std::vector<std::string> names;
    /// Advances the coverages \p theta at a point by \p time (the recipe's unit) under the fluxes there. Where
    /// coverages settle faster than the surface moves, it sets their steady state, whatever the time.
    std::function<void(const SurfacePoint&, double time, std::span<double> theta)> react;
    double tolerance =
        1e-3;  ///< mean change of a coverage at which the iteration at a step's start has converged
    int most_iterations = 20;  ///< of tracing fluxes and updating coverages in turn, at a step's start
    /// Pulsed processes: every time step traces one pulse of this length (the recipe's unit) from a bare
    /// surface, in equal parts, each with the coverages at its beginning. 0: steady state.
    double pulse = 0.0;
    int parts = 1;
    /// Slow processes: coverages go from time step to time step, and `react` takes them through each one's time.
    /// Time 0 must leave those as they are.
    bool transient = false;
    /// Indices of the coverages that diffuse along the surface: d/dt = rate + div(D grad). Only of transient ones.
    std::vector<std::size_t> diffusing = {};
    /// D of coverage \p k at a point, length^2/time, at least 0; to be set where some diffuse.
    std::function<double(std::size_t k, const SurfacePoint&)> diffusivity = {};
    /// d/dt of coverage \p k at a point, 1/time, of its reactions alone; to be set where some diffuse.
    std::function<double(std::size_t k, const SurfacePoint&)> rate = {};
};

/// What a model may say of its speed V beside its values: bounds for schemes and time steps, and forms that save time.
/// Each may be left out, where not said otherwise.
struct SpeedHints {
    /// Bound of |V| where fluxes do not enter; of V(n) as a Hamiltonian, the sum of its |dH/dp|, if it is
    /// sharper.
    std::optional<double> max_speed;
    /// The largest etch rate at a point over all normals, 0 for none; must be set where V depends on the normal. The point's
    /// own normal is not read.
    std::function<double(const SurfacePoint&)> max_etch_rate;
    /// By material: whether V is 0 there whatever arrives and whatever the normal. Empty: not known for any material.
    std::vector<std::uint8_t> inert;
    /// The two numbers of V(n) = facing max(0, n . beam) + always at a point, whose own normal is not read; for models of that
    /// form, whose V need not be evaluated at every node and normal then.
    std::function<levelset::BeamSpeed(const SurfacePoint&)> beam_speed;
    /// By material: bounds of |dH/dp| along the grid's axes, where H = |p| V(p/|p|) is not convex. V of one sign.
    std::vector<Vec3> dissipation;
    std::vector<Vec3> planes;  ///< normals at which V may have a cusp, the slowest first: a crystal's faces
};

/// A process model ready to run: what it traces, how coverages follow from the fluxes, and V from both.
struct Model {
    std::vector<flux::Species> species;
    /// The path of each species' keys in the step, e.g. "species[1]."; empty: beside the model's own.
    std::vector<std::string> species_keys;
    /// By species: the direct flux from the source as a function of the surface's normal, which makes V a function V(n); null
    /// where the direct flux is not known. make_model sets it.
    std::vector<std::shared_ptr<const flux::DirectFlux>> direct;
    /// By species: mean free path in the gas in metres, which make_model (recipe/step_model.hpp) converts into
    /// Species::mean_free_path; 0, or no entry: as the species says.
    std::vector<double> free_paths;
    Coverages coverages;  ///< none by default
    /// Sticking probability of species \p k at a point, of coverages but not of fluxes; empty: as the species says.
    std::function<double(std::size_t k, const SurfacePoint&)> sticking;
    /// Flux of species \p k that desorbs at a point and leaves diffusely, of coverages but not of fluxes; at least 0, and 1
    /// is what arrives on an open flat wafer. Empty: nothing desorbs.
    std::function<double(std::size_t k, const SurfacePoint&)> desorption;
    std::optional<Vec3> visibility;  ///< unit, towards the source, where line of sight counts
    /// Unit, towards the source of a parallel beam that is not traced; the key that gives it is `direction`.
    std::optional<Vec3> beam;
    bool depends_on_position = false;  ///< some function here reads SurfacePoint::position
    int least_time_steps = 1;          ///< a step is cut into: where V depends on time itself
    bool growing_time_steps = false;   ///< the k-th of n of those ends at (k/n)^2 of the step, else k/n
    bool depends_on_normal = false;    ///< V is V(n): needs a scheme with dissipation bounds
    std::function<double(const SurfacePoint&)> speed;  ///< positive grows, negative etches
    /// V at many points at once, each with the normal of its triangle, in the recipe's length per time; replaces `speed`
    /// where it is set. Called once a time step, never in parallel: for laws in other languages.
    std::function<std::vector<double>(std::span<const SurfacePoint>)> speeds;
    bool in_nm_per_s = false;    ///< the unit of `speed`; else the recipe's length per time
    std::optional<int> deposit;  ///< material id of the film that grows
    SpeedHints hints;            ///< what is known of `speed`
    /// Notes by material id for the user of a wafer that has it, beginning with the key concerned; or "".
    std::vector<std::string> notes;
};

/// Names of all fluxes a model sees: the tallies of its species, one after the other (flux/species.hpp).
std::vector<std::string> flux_names(const std::vector<flux::Species>& species);

/// A model that recipes can name. Each lives in a file of app/models/ and has a line in model.cpp. Its parameters are a
/// struct of its own, which a recipe's keys fill (schema/keys.hpp).
struct ModelEntry {
    std::string name;
    std::string doc;
    std::any defaults;  ///< the parameters by default
    std::function<std::vector<Key>(std::any& parameters)> keys;
    /// \throws KeyError where keys that are each right do not fit together.
    std::function<Model(const std::any& parameters, const Materials& materials, const Units& units)> make =
        {};
    /// Geometric steps have this instead: they take no time and trace nothing.
    std::function<void(const GeometricStep& step, const Materials& materials, const levelset::Shape& pattern,
                       levelset::MaterialStack& stack)>
        apply = {};
    bool patterned =
        false;              ///< they have the keys of openings, too, which make `pattern` (recipe/layers.hpp)
    std::string more = {};  ///< what `sidewall models` says after the keys, in lines of its own
};

/// The entry of a model whose parameters are a struct P.
/// \param make  from parameters and materials; from files with units, the recipe's units, too.
template <class P, class Make>
ModelEntry model_entry(std::string name, std::string doc, std::vector<Key> (*keys)(P&), Make make,
                       P defaults = {}) {
    return {std::move(name), std::move(doc), std::move(defaults),
            [keys](std::any& p) { return keys(std::any_cast<P&>(p)); },
            [make](const std::any& p, const Materials& m, const Units& units) {
                if constexpr (std::is_invocable_v<Make, const P&, const Materials&, const Units&>)
                    return make(std::any_cast<const P&>(p), m, units);
                else
                    return make(std::any_cast<const P&>(p), m);
            }};
}

/// A model that does nothing.
Model still_model();

/// All models, in the order they are listed.
const std::vector<ModelEntry>& models();

/// nullptr if there is none of that name.
const ModelEntry* find_model(std::string_view name);

std::vector<std::string> model_names();

/// The key `deposit`, which every model that can grow a film has.
Key deposit_key(std::string& deposit);

/// The key `coverage_tolerance` (Coverages::tolerance).
Key coverage_tolerance_key(double& tolerance);

/// Id of the material that the key `deposit` names.
/// \throws KeyError if \p grows, some speed being positive, and none is named, or if one is named and nothing
///         grows.
std::optional<int> film(const std::string& deposit, const Materials& materials, bool grows);

}  // namespace sidewall::app
