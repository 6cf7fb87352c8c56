#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/results/metrology.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Something that happened to the wafer and is reported to the user at once.
struct Event {
    std::string kind;      ///< kVanished, kDetached, ...
    double time = 0.0;     ///< process time of the time step that found it
    std::size_t step = 0;  ///< index of the recipe's step that caused it, loops unrolled
    std::string material;  ///< what vanished or came off; empty for other events
    std::size_t count = 1;
    double volume = 0.0;     ///< total of the pieces or voids
    Vec3 at = Vec3::Zero();  ///< highest point of the largest piece or void; or lowest or highest point of a
                             ///< surface that has reached the bottom or top
};

inline constexpr const char* kVanished = "material-vanished";    ///< less than 1 % of a material is left
inline constexpr const char* kDetached = "piece-detached";       ///< a piece of material hangs in the gas
inline constexpr const char* kVoidClosed = "void-closed";        ///< gas is shut in
inline constexpr const char* kBottomReached = "bottom-reached";  ///< the bottom of the substrate
inline constexpr const char* kTopReached = "top-reached";        ///< the top of the room for films

inline constexpr const char* kDuration = "duration";  ///< ends a step that no stop condition has ended

/// Sums over the traced time steps of a step, for its noise (process/noise.hpp).
struct StepNoise {
    double squares = 0.0;  ///< of (relative error * dt)^2
    double time = 0.0;     ///< of dt
    double dt = 0.0;       ///< the last time step's, no sum
};

/// How a step of the recipe ended.
struct StepEnd {
    double duration = 0.0;                      ///< process time taken, including over-etch
    std::string stopped_by;                     ///< kDuration, or the key of the stop condition that held
    double grown = 0.0;                         ///< volume gained by all materials less volume lost
    double time = 0.0;                          ///< process time at its end
    bool has_stop = false;                      ///< the step has a stop condition
    std::optional<double> endpoint;             ///< process time at which a stop condition first held
    double over_etch = 0.0;                     ///< time after the endpoint
    std::optional<double> endpoint_bare, bare;  ///< bare share of the floor (process/endpoint.hpp) at the
                                                ///< endpoint and at the end, if it stops at a material
    std::vector<Measure> measures;              ///< of the wafer at its end
    StepNoise noise;
};

/// Events and volumes that summary.json reports, and what is needed to find them. Part of the run's state.
struct History {
    std::vector<Event> events;
    std::vector<StepEnd> ends;          ///< by step done, loops unrolled
    std::vector<double> initial, most;  ///< by material: volume at time 0; largest then or after a step
    std::vector<double> added,
        removed;  ///< by material: sums over all steps, positive; added is 0 for what no step can grow

    // At the beginning of the current step:
    std::vector<int> layer_materials;
    std::vector<double> layer_volumes;

    // At the last call of note_events:
    std::vector<std::uint8_t> present;  ///< by material: whether it has not vanished
    std::vector<Box3> hanging, voids;
    bool bottom_reached = false, top_reached = false;

    std::vector<std::size_t> found;  ///< by layer: where levelset::volume_left found it; not saved
};

/// The history of a run that begins with \p stack.
History begin_history(const levelset::MaterialStack& stack, std::size_t materials);

/// Records that step \p step has ended, and the volumes added and removed in it. They are counted by layer,
/// so a material that one layer loses and another gains counts in both sums; by material if the step has
/// changed the list of layers other than by films on top.
/// \param may_grow  of a material id: whether the step can grow it. Other gains are grid errors, and ignored.
void end_step(const levelset::MaterialStack& stack, std::size_t step, StepEnd end,
              const std::function<bool(int)>& may_grow, History& history);

/// Records the layers that the next step begins with; only needed if they have changed since end_step.
void note_layers(const levelset::MaterialStack& stack, History& history);

/// Resizes the lists to the number of materials of a new recipe.
void resize_to_materials(History& history, std::size_t materials);

/// \throws FileError if it is no history of a run with so many materials that has come to step \p step.
void require_whole(const History& history, std::size_t materials, std::size_t step);

}  // namespace sidewall::app
