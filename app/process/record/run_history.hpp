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

/// Something that happened to the wafer and that its user should hear of at once.
struct Event {
    std::string kind;      ///< kVanished and the like
    double time = 0.0;     ///< process time at which it was seen
    std::size_t step = 0;  ///< of the recipe, loops unrolled, that did it
    std::string material;  ///< what vanished or came off; empty if it is no matter of materials
    std::size_t count = 1;
    double volume = 0.0;     ///< of all that came off or was shut in
    Vec3 at = Vec3::Zero();  ///< the top of the largest of these, or the lowest or highest point of a surface
                             ///< at its end
};

inline constexpr const char* kVanished = "material-vanished";    ///< nothing is left of it
inline constexpr const char* kDetached = "piece-detached";       ///< it hangs in the gas
inline constexpr const char* kVoidClosed = "void-closed";        ///< gas that nothing gets into any more
inline constexpr const char* kBottomReached = "bottom-reached";  ///< of the substrate
inline constexpr const char* kTopReached = "top-reached";        ///< of the room for films

inline constexpr const char* kDuration = "duration";  ///< what ends a step that no stop condition ends

/// Noise of the time steps of a step that were traced (process/noise.hpp).
struct StepNoise {
    double squares = 0.0;  ///< sum of (relative error times time)^2
    double time = 0.0;     ///< sum of times
    double dt = 0.0;       ///< of the last of them
};

/// How a step of the recipe ended.
struct StepEnd {
    double duration = 0.0;           ///< that it took, over-etch and all
    std::string stopped_by;          ///< kDuration, or the key of the stop condition that held
    double grown = 0.0;              ///< volume that all materials gained in it, less what they lost
    double time = 0.0;               ///< process time then
    bool has_stop = false;           ///< the step has a stop condition
    std::optional<double> endpoint;  ///< process time at which a stop condition held, if one did
    double over_etch = 0.0;          ///< time after it
    std::optional<double> endpoint_bare, bare;  ///< shares of the floor (process/endpoint.hpp) that were bare
                                                ///< at the endpoint and at the end, if it stops at a material
    std::vector<Measure> measures;              ///< of the wafer then
    StepNoise noise;
};

/// Events and volumes that summary.json reports of a run, and what it needs to know for that. Part of
/// its state.
struct History {
    std::vector<Event> events;
    std::vector<StepEnd> ends;          ///< of the steps made, loops unrolled
    std::vector<double> initial, most;  ///< volumes at time 0 and the largest after a step, by material
    std::vector<double> added,
        removed;  ///< by material: sums over the steps, positive; added is 0 of what no step could grow

    // When the step at hand began.
    std::vector<int> layer_materials;
    std::vector<double> layer_volumes;

    // At the last check.
    std::vector<std::uint8_t> present;  ///< by material: something of it is left
    std::vector<Box3> hanging, voids;
    bool bottom_reached = false, top_reached = false;

    std::vector<std::size_t> found;  ///< by layer, where levelset::volume_left found it; not saved
};

/// The history of a run that begins with \p stack.
History begin_history(const levelset::MaterialStack& stack, std::size_t materials);

/// Notes that step number \p step ended, and what it added and removed since the one before: by layer, and so
/// that a material which one layer loses and another gains counts twice; by material where the step has
/// changed the list of layers.
/// \param may_grow  of a material's id: whether the step can grow it. What another one gains is the grid's error and counts
///                  as nothing.
void end_step(const levelset::MaterialStack& stack, std::size_t step, StepEnd end,
              const std::function<bool(int)>& may_grow, History& history);

/// Notes the layers that the next step begins with; end_step has done so unless they have changed since.
void note_layers(const levelset::MaterialStack& stack, History& history);

/// Makes room for the materials of a recipe that goes on from another one.
void fit(History& history, std::size_t materials);

/// \throws FileError if it is not the history of a run with so many materials that has come to step number \p step.
void require_whole(const History& history, std::size_t materials, std::size_t step);

}  // namespace sidewall::app
