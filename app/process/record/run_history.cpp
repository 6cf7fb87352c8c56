#include "app/process/record/run_history.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/common/json.hpp"
#include "app/results/cut_profile.hpp"
#include "app/results/metrology.hpp"
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

Json point_json(const Vec3& p) {
    return Json::array({p.x(), p.y(), p.z()});
}

Vec3 point_from_json(const Json& json) {
    return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

Json boxes_json(const std::vector<Box3>& boxes) {
    Json list = Json::array();
    for (const Box3& box : boxes) list.push_back(Json::array({point_json(box.min), point_json(box.max)}));
    return list;
}

std::vector<Box3> boxes_from_json(const Json& json) {
    std::vector<Box3> boxes;
    for (const Json& box : json) boxes.push_back({point_from_json(box.at(0)), point_from_json(box.at(1))});
    return boxes;
}

Json optional_json(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

std::optional<double> optional_from_json(const Json& json, const char* key) {
    return json.contains(key) && !json[key].is_null() ? std::optional(json[key].get<double>()) : std::nullopt;
}

Json end_json(const StepEnd& end) {
    Json measures = Json::array();
    for (const Measure& m : end.measures)
        measures.push_back(Json{
            {"name", m.name}, {"unit", m.unit}, {"value", std::isfinite(m.value) ? Json(m.value) : Json()}});
    return {{"duration", end.duration},
            {"stopped_by", end.stopped_by},
            {"grown", end.grown},
            {"time", end.time},
            {"has_stop", end.has_stop},
            {"endpoint", optional_json(end.endpoint)},
            {"over_etch", end.over_etch},
            {"endpoint_bare", optional_json(end.endpoint_bare)},
            {"bare", optional_json(end.bare)},
            {"measures", measures}};
}

// Earlier versions wrote the first two entries alone.
StepEnd end_from_json(const Json& json) {
    StepEnd end;
    end.duration = json.at("duration").get<double>();
    end.stopped_by = json.at("stopped_by").get<std::string>();
    end.grown = json.value("grown", 0.0);
    end.time = json.value("time", 0.0);
    end.has_stop = json.value("has_stop", false);
    end.endpoint = optional_from_json(json, "endpoint");
    end.over_etch = json.value("over_etch", 0.0);
    end.endpoint_bare = optional_from_json(json, "endpoint_bare");
    end.bare = optional_from_json(json, "bare");
    for (const Json& m : json.value("measures", Json::array()))
        end.measures.push_back({m.at("name").get<std::string>(),
                                optional_from_json(m, "value").value_or(kNone),
                                m.at("unit").get<std::string>()});
    return end;
}

bool finite(const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

void check(const History& history, std::size_t materials, std::size_t step) {
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

}  // namespace

History begin_history(const levelset::MaterialStack& stack, std::size_t materials) {
    History history;
    note_layers(stack, history);
    history.initial = by_material(history.layer_materials, history.layer_volumes, materials);
    history.most = history.initial;
    // The substrate's is counted from z = 0 down: it has no end.
    history.most[static_cast<std::size_t>(history.layer_materials.front())] = 0.0;
    history.added.resize(materials, 0.0);
    history.removed.resize(materials, 0.0);
    return history;
}

void end_step(const levelset::MaterialStack& stack, std::size_t step, StepEnd end,
              const std::function<bool(int)>& may_grow, History& history) {
    history.ends.resize(step + 1);
    end.grown = history.ends[step].grown;  // of a step that is extended
    history.ends[step] = std::move(end);
    const std::vector<int> before_materials = std::move(history.layer_materials),
                           materials = layer_materials(stack);
    const std::vector<double> before = std::move(history.layer_volumes), after = layer_volumes(stack);
    history.ends[step].grown +=
        std::accumulate(after.begin(), after.end(), 0.0) - std::accumulate(before.begin(), before.end(), 0.0);
    const auto account = [&](std::size_t material, double change) {
        if (change > 0.0 && !may_grow(static_cast<int>(material))) return;
        (change > 0.0 ? history.added : history.removed)[material] += std::abs(change);
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

void fit(History& history, std::size_t materials) {
    for (auto* volumes : {&history.initial, &history.most, &history.added, &history.removed})
        volumes->resize(materials, 0.0);
    history.present.resize(materials, 0);
}

Json to_json(const History& history) {
    Json json{{"initial", history.initial},
              {"most", history.most},
              {"added", history.added},
              {"removed", history.removed},
              {"layer_materials", history.layer_materials},
              {"layer_volumes", history.layer_volumes},
              {"present", history.present},
              {"hanging", boxes_json(history.hanging)},
              {"voids", boxes_json(history.voids)},
              {"bottom_reached", history.bottom_reached},
              {"top_reached", history.top_reached},
              {"events", Json::array()},
              {"ends", Json::array()}};
    for (const Event& event : history.events)
        json["events"].push_back(Json{{"kind", event.kind},
                                      {"time", event.time},
                                      {"step", event.step},
                                      {"material", event.material},
                                      {"count", event.count},
                                      {"volume", event.volume},
                                      {"at", point_json(event.at)}});
    for (const StepEnd& end : history.ends) json["ends"].push_back(end_json(end));
    return json;
}

History history_from_json(const Json& json, std::size_t materials, std::size_t step) {
    History history;
    json.at("initial").get_to(history.initial);
    json.at("most").get_to(history.most);
    json.at("added").get_to(history.added);
    json.at("removed").get_to(history.removed);
    json.at("layer_materials").get_to(history.layer_materials);
    json.at("layer_volumes").get_to(history.layer_volumes);
    json.at("present").get_to(history.present);
    history.hanging = boxes_from_json(json.at("hanging"));
    history.voids = boxes_from_json(json.at("voids"));
    json.at("bottom_reached").get_to(history.bottom_reached);
    json.at("top_reached").get_to(history.top_reached);
    for (const Json& event : json.at("events"))
        history.events.push_back({event.at("kind").get<std::string>(), event.at("time").get<double>(),
                                  event.at("step").get<std::size_t>(),
                                  event.at("material").get<std::string>(),
                                  event.at("count").get<std::size_t>(), event.at("volume").get<double>(),
                                  point_from_json(event.at("at"))});
    for (const Json& end : json.at("ends")) history.ends.push_back(end_from_json(end));
    check(history, materials, step);
    return history;
}

}  // namespace sidewall::app
