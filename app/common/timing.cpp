#include "app/common/timing.hpp"

#include <chrono>
#include <ctime>

#include "app/common/json.hpp"

namespace sidewall::app {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_seconds() {
    return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

Json to_json(const Timing& timing) {
    Json json = Json::object();
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
