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

/// What a model is given of a point on the surface.
struct SurfacePoint {
    int material = 0;  ///< id of the material under the point
    /// All tallies of all species, in the order of flux_names; 1 is the arrivals on an open flat wafer, where
    /// a yield's tally is the mean yield of a hit.
    std::span<const double> flux;
    Vec3 normal = Vec3::UnitZ();  ///< unit, out of the material
    bool visible = true;          ///< the source is in line of sight; set only where Model::visibility is
    std::span<const double> coverage = {};  ///< in the order of Coverages::names
    Vec3 position = Vec3::Zero();           ///< lengths; only where Model::depends_on_position is set
    double time = 0.0;                      ///< since the step began, in the recipe's unit
};

/// Adsorbates on the surface, as fractions of its sites, and their kinetics. Each time step starts from the
/// coverages of the one before. Fluxes and coverages depend on each other through the sticking probability.
struct Coverages {
    std::vector<std::string> names;
    /// Advances the coverages \p theta at a point by \p time (the recipe's unit) under the fluxes there. Sets
    /// the steady state, whatever the time, where coverages settle faster than the surface moves.
    std::function<void(const SurfacePoint&, double time, std::span<double> theta)> react;
    double tolerance = 1e-3;   ///< mean change of a coverage below which the iteration at a step's start ends
    int most_iterations = 20;  ///< traces of that iteration, at most; each is followed by an update
    /// Length of a pulse (the recipe's unit); 0: steady state. Each time step traces one pulse on a bare
    /// surface, in `parts` equal parts, each with the coverages at its beginning.
    double pulse = 0.0;
    int parts = 1;
    /// Slow kinetics: coverages persist, and `react` advances them by the length of each time step; time 0
    /// must not change these coverages.
    bool transient = false;
    /// Indices of the coverages that diffuse along the surface: d/dt = rate + div(D grad). Only if transient.
    std::vector<std::size_t> diffusing = {};
    /// D of coverage \p k at a point, length^2/time, at least 0; required where some diffuse.
    std::function<double(std::size_t k, const SurfacePoint&)> diffusivity = {};
    /// d/dt of coverage \p k at a point by reactions alone, 1/time; required where some diffuse.
    std::function<double(std::size_t k, const SurfacePoint&)> rate = {};
};

/// Optional facts about a model's speed V: bounds for schemes and time steps, and cheaper forms of V.
struct SpeedHints {
    /// Bound of |V|, for models without fluxes. For V(n) as a Hamiltonian it may be the maximum of the sum of
    /// |dH/dp| over the axes: kinks move faster than planes.
    std::optional<double> max_speed;
    /// Largest etch rate at a point over all normals, 0 for none; reads no normal. Required where V depends
    /// on the normal.
    std::function<double(const SurfacePoint&)> max_etch_rate;
    /// By material: whether V is 0 there for any fluxes and any normal. Empty: not known.
    std::vector<std::uint8_t> inert;
    /// Both numbers of V(n) = facing max(0, n . beam) + always at a point; reads no normal. Only for models
    /// of that form: it spares evaluating V at every node and normal.
    std::function<levelset::BeamSpeed(const SurfacePoint&)> beam_speed;
    /// By material: bounds of |dH/dp| along the grid's axes, H = |p| V(p/|p|), where H is not convex and V
    /// has one sign.
    std::vector<Vec3> dissipation;
    std::vector<Vec3> planes;  ///< normals at which V may have a cusp, slowest first: a crystal's faces
};

/// A process model ready to run: what it traces, how coverages follow from fluxes, and V from both.
struct Model {
    std::vector<flux::Species> species;
    /// Path of each species' keys in the step, e.g. "species[1]."; empty: the step itself holds them.
    std::vector<std::string> species_keys;
    /// By species: direct flux from the source as a function of the surface normal, which makes V depend on
    /// the normal; null where it is not known. make_model sets it.
    std::vector<std::shared_ptr<const flux::DirectFlux>> direct;
    /// By species: mean free path in the gas, in metres; 0 or no entry: Species::mean_free_path counts.
    /// make_model (recipe/step_model.hpp) converts it to that.
    std::vector<double> free_paths;
    Coverages coverages;  ///< none by default
    /// Sticking probability of species \p k; may read coverages, not fluxes. Empty: Species::sticking.
    std::function<double(std::size_t k, const SurfacePoint&)> sticking;
    /// Flux of species \p k that desorbs at a point, diffusely; may read coverages, not fluxes. At least 0; 1
    /// is the flux that arrives on an open flat wafer. Empty: nothing desorbs.
    std::function<double(std::size_t k, const SurfacePoint&)> desorption;
    std::optional<Vec3> visibility;  ///< unit vector towards the source, where line of sight counts
    /// Unit vector towards the source of a parallel beam that is not traced; its key is `direction`.
    std::optional<Vec3> beam;
    bool depends_on_position = false;  ///< whether a function of the model reads SurfacePoint::position
    int min_time_steps = 1;  ///< time steps that a step has at least, where V depends on time itself
    bool parabolic_time_steps =
        false;                       ///< the k-th of n such time steps ends at (k/n)^2 of the step, else k/n
    bool depends_on_normal = false;  ///< V is V(n): the scheme needs dissipation bounds
    std::function<double(const SurfacePoint&)> speed;  ///< positive grows, negative etches
    /// V at many points at once, each with its triangle's normal, in the recipe's length per time. Replaces
    /// `speed` where set: for laws in other languages. Called once a time step, never in parallel.
    std::function<std::vector<double>(std::span<const SurfacePoint>)> speeds;
    bool in_nm_per_s = false;    ///< the unit of `speed`; else the recipe's length per time
    std::optional<int> deposit;  ///< material id of the film that grows
    SpeedHints hints;            ///< facts about `speed`
    /// By material id: a note for users whose wafer has it, which begins with the key concerned; or "".
    std::vector<std::string> notes;
};

/// Names of all fluxes a model sees: the tallies of its species, one after the other (flux/species.hpp).
std::vector<std::string> flux_names(const std::vector<flux::Species>& species);

/// A model that recipes can name. Each is defined in a file of app/models/ and listed in model.cpp. Its
/// parameters are a struct, which a recipe's keys fill (schema/keys.hpp).
struct ModelEntry {
    std::string name;
    std::string doc;
    std::any defaults;  ///< the parameters' defaults
    std::function<std::vector<Key>(std::any& parameters)> keys;
    /// \throws KeyError where keys that are valid one by one contradict each other.
    std::function<Model(const std::any& parameters, const Materials& materials, const Units& units)> make =
        {};
    /// Geometric steps have this in place of `make`: they take no time and trace nothing.
    std::function<void(const GeometricStep& step, const Materials& materials, const levelset::Shape& pattern,
                       levelset::MaterialStack& stack)>
        apply = {};
    bool patterned =
        false;              ///< a geometric step with openings, whose keys make `pattern` (recipe/layers.hpp)
    std::string more = {};  ///< text that `sidewall models` prints after the keys, on separate lines
};

/// The entry of a model whose parameters are a struct P.
/// \param make  takes parameters and materials; also the recipe's units where it reads files with units.
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

/// The model of that name; nullptr if there is none.
const ModelEntry* find_model(std::string_view name);

std::vector<std::string> model_names();

/// The key `deposit`, which every model that can grow a film has.
Key deposit_key(std::string& deposit);

/// The key `coverage_tolerance` (Coverages::tolerance).
Key coverage_tolerance_key(double& tolerance);

/// Id of the material that the key `deposit` names.
/// \throws KeyError if \p grows, V > 0 somewhere, and none is named; or if none grows and one is named.
std::optional<int> film(const std::string& deposit, const Materials& materials, bool grows);

}  // namespace sidewall::app
