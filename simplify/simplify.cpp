#include "simplify/simplify.hpp"

#include <chrono>

#include "simplify/cgal_lindstrom_turk.hpp"
#include "simplify/lindstrom_turk.hpp"
#include "simplify/region.hpp"
#include "simplify/region_bounded.hpp"
#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Result collapse(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options) {
    const bool bounded = options.method == Method::region_bounded;
    const bool region = options.method == Method::region || bounded;
    const double base =
        base_length(mesh, region ? features : std::span<const std::uint8_t>{}, options.grid_spacing);
    if (bounded) return simplify_regions_bounded(mesh, features, resolve_region(options, base));
    if (region) return simplify_regions(mesh, features, resolve_region(options, base));
    const LindstromTurkOptions plain = resolve_lindstrom_turk(options, base);
    return options.method == Method::cgal_lindstrom_turk ? simplify_cgal_lindstrom_turk(mesh, plain)
                                                         : simplify_lindstrom_turk(mesh, plain);
}

}  // namespace

Result simplify(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options) {
    if (options.method == Method::cgal_lindstrom_turk && options.max_error)
        throw RecipeError(
            "simplify.max_error: method \"cgal-lindstrom-turk\" cannot keep a hard bound; use another "
            "method");
    const double start = now();
    Result result;
    if (options.method == Method::none || mesh.triangles.empty()) {
        result.mesh = mesh;
    } else {
        result = collapse(mesh, features, options);
        result.seconds.collapse = now() - start;
        for (const auto* attributes : {&mesh.vertex_attributes, &mesh.triangle_attributes})
            for (const Attribute& a : *attributes)
                if (attributes == &mesh.vertex_attributes || a.name != "material")
                    result.dropped_attributes.push_back(a.name);
    }
    result.seconds.total = now() - start;
    return result;
}

}  // namespace sidewall::simplify
