#pragma once
#include <fmt/format.h>

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/common/json_fwd.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Writes indented JSON to a file, or to standard output if \p path is "-". Non-finite numbers become null.
/// \throws IoError naming the path and the system's reason.
void write_json(const std::string& path, const Json& json);

/// A number, or null where it is not finite, which JSON cannot hold.
/// \param digits  number of significant digits that the value is rounded to.
Json number_or_null(double value, int digits = 17);

/// The numbers of vertices and triangles: {"vertices": ..., "triangles": ...}.
Json mesh_sizes(const TriangleMesh& mesh);

/// Parses JSON. The result is discarded if the text is no JSON, is over 64 levels deep, or has over \p most
/// keys, values, and begins and ends of lists and objects: an object of n keys takes a time of O(n^2).
Json parse_json(const std::string& text, std::size_t most = SIZE_MAX);

/// The JSON in a file.
/// \throws FileError if the file is missing or no JSON; the message ends with \p advice.
Json read_json(const std::filesystem::path& path, const std::string& advice);

}  // namespace sidewall::app

/// Converts a struct to and from a JSON object of the named members; missing ones get their default.
#define SIDEWALL_JSON(Type, ...)                                                                \
    inline void to_json(Json& nlohmann_json_j, const Type& nlohmann_json_t) {                   \
        NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_TO, __VA_ARGS__))                \
    }                                                                                           \
    inline void from_json(const Json& nlohmann_json_j, Type& nlohmann_json_t) {                 \
        const Type nlohmann_json_default_obj;                                                   \
        NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_FROM_WITH_DEFAULT, __VA_ARGS__)) \
    }

/// \cond  Doxygen cannot place specializations of other libraries' templates.
/// An optional is null in JSON where it has no value.
template <class T>
requires(!std::same_as<T, sidewall::app::Json>) struct nlohmann::adl_serializer<std::optional<T>> {
    static void to_json(sidewall::app::Json& json, const std::optional<T>& value) {
        json = value ? sidewall::app::Json(*value) : sidewall::app::Json();
    }
    static void from_json(const sidewall::app::Json& json, std::optional<T>& value) {
        value = json.is_null() ? std::nullopt : std::optional(json.get<T>());
    }
};

/// Formats the number or text that JSON holds as fmt does; `{:.3g}` takes whole numbers, too, null is "none".
template <>
struct fmt::formatter<sidewall::app::Json> {
    constexpr const char* parse(fmt::format_parse_context& context) {
        const char* end = context.begin();
        while (end != context.end() && *end != '}') ++end;
        spec = {context.begin(), static_cast<std::size_t>(end - context.begin())};
        return end;
    }
    fmt::appender format(const sidewall::app::Json& json, fmt::format_context& context) const;

    std::string_view spec;  ///< between the colon and the closing brace
};
/// \endcond
