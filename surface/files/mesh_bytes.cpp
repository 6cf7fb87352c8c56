#include "surface/files/mesh_bytes.hpp"

#include <cctype>

#include "surface/files/file.hpp"

namespace sidewall::surface {
namespace {

bool is_space(char c) {
    return std::isspace(static_cast<unsigned char>(c)) != 0;
}

}  // namespace

std::string_view without_mark(std::string_view text, const std::string& name) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        throw FileError("{}: is UTF-16 text: save it as UTF-8", name);
    return text.substr(text.starts_with("\xef\xbb\xbf") ? 3 : 0);
}

std::string_view next_line(std::string_view text, std::size_t& at) {
    const std::string_view rest = text.substr(at);
    const auto end = static_cast<std::size_t>(
        std::find_if(rest.begin(), rest.end(), [](char c) { return c == '\n' || c == '\r'; }) - rest.begin());
    at += end + (rest.substr(end).starts_with("\r\n") ? 2 : 1);
    return rest.substr(0, end);
}

void skip_space(std::string_view& text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
}

std::optional<double> next_number(std::string_view& text) {
    const bool plus = text.starts_with('+');
    const char *begin = text.data() + plus, *end = text.data() + text.size();
    double value = 0.0;
    const auto [stop, failure] = std::from_chars(begin, end, value);
    if (failure != std::errc{} || (plus && *begin == '-') || (stop != end && !is_space(*stop)))
        return std::nullopt;
    text = {stop, end};
    return value;
}

std::string excerpt(std::string_view text) {
    constexpr std::size_t kCharacters = 12;
    return printable(text.substr(0, kCharacters));
}

void check_read_mesh(const TriangleMesh& mesh, const std::string& name) {
    if (mesh.triangles.empty())
        throw FileError("{}: holds no triangle: export the surface as polygons", name);
    // Lengths beyond this may overflow when multiplied in single precision, in which rays are traced.
    constexpr double kLargest = 1e15;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& p = mesh.vertices[i];
        if (!p.allFinite())
            throw FileError("{}: vertex {} is ({}, {}, {}): not finite; export the surface again", name, i,
                            p.x(), p.y(), p.z());
        if (p.cwiseAbs().maxCoeff() > kLargest)
            throw FileError("{}: vertex {} lies beyond {}: choose a larger length unit", name, i, kLargest);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.vertices.size())
                throw FileError("{}: triangle {} names vertex {} of {}: the file is damaged", name, t, v,
                                mesh.vertices.size());
}

void check_written_mesh(const TriangleMesh& mesh) {
    const auto check = [](const std::vector<Attribute>& attributes, std::size_t count, const char* where) {
        for (const Attribute& a : attributes)
            if (a.components < 1 || a.values.size() != static_cast<std::size_t>(a.components) * count)
                throw GeometryError("{} attribute '{}' has {} values: must be {} x {}", where, a.name,
                                    a.values.size(), a.components, count);
    };
    check(mesh.vertex_attributes, mesh.vertices.size(), "vertex");
    check(mesh.triangle_attributes, mesh.triangles.size(), "triangle");
}

}  // namespace sidewall::surface
