#include "app/common/json.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

#include "app/common/files.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {

void write_json(const std::string& path, const Json& json) {
    // A path need not be UTF-8, JSON must.
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (path == "-") {
        if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
            throw IoError(
                fmt::format("standard output: cannot write: {}; check space on the device it goes to",
                            std::strerror(errno)));
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

Json read_json(const std::filesystem::path& path, const std::string& advice) {
    Json json = Json::parse(surface::read_whole_file(path), nullptr, false);
    if (json.is_discarded()) throw FileError(fmt::format("{}: is no JSON: {}", path.string(), advice));
    return json;
}

}  // namespace sidewall::app
