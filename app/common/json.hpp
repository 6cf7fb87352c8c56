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
/// \param digits  significant ones; those beyond are rounded away.
Json number_or_null(double value, int digits = 17);

/// The numbers of vertices and triangles: {"vertices": ..., "triangles": ...}.
Json mesh_sizes(const TriangleMesh& mesh);

/// The JSON of a text. It is discarded if it is no JSON, is nested deeper than 64 levels, or has more than \p most keys and
/// values, ends of lists and objects among them: the time of an object grows with the square of its keys.
Json parse_json(const std::string& text, std::size_t most = SIZE_MAX);

/// The JSON in a file.
/// \throws FileError if the file is missing or no JSON; the message ends with \p advice.
Json read_json(const std::filesystem::path& path, const std::string& advice);

}  // namespace sidewall::app

/// Lets JSON hold a struct as an object of the members named; those that the JSON lacks get their default.
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

/// Prints what JSON holds as fmt prints such a number or text: `{:.3g}` and the like take whole numbers, too. What is null
/// is "none".
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
