#include "app/common/timing.hpp"

#include "app/common/json.hpp"

namespace sidewall::app {

Json to_json(const Timing& timing) {
    Json json;
    for_each_phase([&](const char* name, double Timing::*phase) { json[name] = timing.*phase; });
    return json;
}

Timing timing_from_json(const Json& json) {
    Timing timing;
    for_each_phase(
        [&](const char* name, double Timing::*phase) { timing.*phase = json.at(name).get<double>(); });
    return timing;
}

}  // namespace sidewall::app
