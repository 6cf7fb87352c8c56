#include "app/common/json.hpp"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "app/common/files.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {

void write_json(const std::string& path, const Json& json) {
    // JSON must be UTF-8; a path in it need not be, and its invalid bytes are replaced.
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (path == "-") {
        if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
            throw IoError("standard output: cannot write: {}; check space on the device it goes to",
                          std::strerror(errno));
    } else {
        write_file(path, text);
    }
}

Json number_or_null(double value, int digits) {
    if (!std::isfinite(value)) return nullptr;
    const std::string text = fmt::format("{:.{}g}", value, digits);
    double rounded = value;
    std::from_chars(text.data(), text.data() + text.size(), rounded);
    return rounded;
}

Json mesh_sizes(const TriangleMesh& mesh) {
    return Json{{"vertices", mesh.vertices.size()}, {"triangles", mesh.triangles.size()}};
}

Json parse_json(const std::string& text, std::size_t most) {
    constexpr int kDeepest = 64;  // copies of nested JSON recurse
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

Json read_json(const fs::path& path, const std::string& advice) {
    Json json = parse_json(surface::read_whole_file(path));
    if (json.is_discarded()) throw FileError("{}: is no JSON: {}", path.string(), advice);
    return json;
}

}  // namespace sidewall::app

fmt::appender fmt::formatter<sidewall::app::Json>::format(const sidewall::app::Json& json,
                                                          fmt::format_context& context) const {
    const auto print = [&](std::string_view how, const auto& value) {
        return fmt::vformat_to(context.out(), fmt::format("{{:{}}}", how), fmt::make_format_args(value));
    };
    if (!json.is_number()) {  // of its format only fill, alignment and width apply
        const std::string_view place = spec.substr(0, spec.find_last_of("<>^0123456789") + 1);
        const std::string text = json.is_string() ? json.get<std::string>() : json.dump();
        return print(place.substr(0, place.find('.')), json.is_null() ? "none" : text);
    }
    if (json.is_number_float() || spec.find_first_of("efg") != spec.npos)
        return print(spec, json.get<double>());
    return json.is_number_unsigned() ? print(spec, json.get<std::uint64_t>())
                                     : print(spec, json.get<std::int64_t>());
}
