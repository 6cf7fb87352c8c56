#include "app/process/record/run_history.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

std::vector<double> by_material(const std::vector<int>& materials, const std::vector<double>& volumes,
                                std::size_t count) {
    std::vector<double> sums(count, 0.0);
    for (std::size_t k = 0; k < volumes.size(); ++k)
        sums[static_cast<std::size_t>(materials[k])] += volumes[k];
    return sums;
}

bool finite(const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

History begin_history(const levelset::MaterialStack& stack, std::size_t materials) {
    History history;
    note_layers(stack, history);
    history.initial = by_material(history.layer_materials, history.layer_volumes, materials);
    history.most = history.initial;
    // The substrate's volume counts from z = 0; as it has no lower end, there is no largest volume.
    history.most[static_cast<std::size_t>(history.layer_materials.front())] = 0.0;
    history.added.resize(materials, 0.0);
    history.removed.resize(materials, 0.0);
    return history;
}

void end_step(const levelset::MaterialStack& stack, std::size_t step, StepEnd end,
              const std::function<bool(int)>& may_grow, History& history) {
    history.ends.resize(step + 1);
    end.grown = history.ends[step].grown;  // nonzero if the step is extended
    history.ends[step] = std::move(end);
    const std::vector<int> before_materials = std::move(history.layer_materials),
                           materials = layer_materials(stack);
    const std::vector<double> before = std::move(history.layer_volumes), after = layer_volumes(stack);
    history.ends[step].grown +=
        std::accumulate(after.begin(), after.end(), 0.0) - std::accumulate(before.begin(), before.end(), 0.0);
    const auto account = [&](std::size_t material, double change) {
        if (change > 0.0 && may_grow(static_cast<int>(material)))
            history.added[material] += change;
        else  // the meshes' errors at contact lines, of either sign, must not add up
            history.removed[material] -= change;
    };
    const std::size_t count = history.initial.size();
    const std::vector<double> is = by_material(materials, after, count);
    for (std::size_t m = 0; m < count; ++m)
        if (static_cast<int>(m) != materials.front()) history.most[m] = std::max(history.most[m], is[m]);
    const bool films_alone = before.size() <= after.size() &&
                             std::equal(before_materials.begin(), before_materials.end(), materials.begin());
    if (films_alone) {
        for (std::size_t k = 0; k < after.size(); ++k)
            account(static_cast<std::size_t>(materials[k]), after[k] - (k < before.size() ? before[k] : 0.0));
    } else {
        const std::vector<double> was = by_material(before_materials, before, count);
        for (std::size_t m = 0; m < count; ++m) account(m, is[m] - was[m]);
    }
    history.layer_materials = materials;
    history.layer_volumes = after;
}

void note_layers(const levelset::MaterialStack& stack, History& history) {
    history.layer_materials = layer_materials(stack);
    history.layer_volumes = layer_volumes(stack);
}

void resize_to_materials(History& history, std::size_t materials) {
    for (auto* volumes : {&history.initial, &history.most, &history.added, &history.removed})
        volumes->resize(materials, 0.0);
    history.present.resize(materials, 0);
}

void require_whole(const History& history, std::size_t materials, std::size_t step) {
    bool good = history.present.size() == materials && history.ends.size() >= step &&
                history.layer_materials.size() == history.layer_volumes.size() &&
                finite(history.layer_volumes);
    for (const auto* volumes : {&history.initial, &history.most, &history.added, &history.removed})
        good = good && volumes->size() == materials && finite(*volumes);
    for (const int m : history.layer_materials)
        good = good && m >= 0 && static_cast<std::size_t>(m) < materials;
    for (const StepEnd& end : history.ends) good = good && std::isfinite(end.grown);
    for (const Event& event : history.events)
        good = good && event.step <= step && std::isfinite(event.time) && std::isfinite(event.volume) &&
               event.at.allFinite();
    if (!good) throw FileError("its history does not fit its wafer");
}

}  // namespace sidewall::app
