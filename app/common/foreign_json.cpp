#include "app/common/foreign_json.hpp"

#include "app/common/json.hpp"

namespace sidewall::app {

Json parse_foreign_json(const std::string& text, std::size_t most) {
    constexpr int kDeepest = 64;  // copies recurse
    struct TooMany {};
    const auto counted = [&](int depth, Json::parse_event_t, Json&) {
        if (most-- == 0 || depth > kDeepest) throw TooMany();
        return true;
    };
    try {
        return Json::parse(text, counted, false);
    } catch (const TooMany&) {
        return Json::value_t::discarded;
    }
}

}  // namespace sidewall::app
