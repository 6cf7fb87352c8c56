#include "simplify/lindstrom_turk.hpp"

#include "simplify/collapse.hpp"

namespace sidewall::simplify {

Result simplify_lindstrom_turk(const TriangleMesh& mesh, const LindstromTurkOptions& options) {
    check(options);
    CollapseEngine engine(mesh, options.weights, options.fixed);
    engine.report_to(options.progress);
    Result result;
    const std::size_t removed = engine.run({.max_length = options.max_edge_length,
                                            .target_vertices = options.target_vertices.value_or(0),
                                            .max_error = options.max_error,
                                            .defer_outliers = true});
    result.passes.push_back({options.max_edge_length, removed});
    result.mesh = engine.take_mesh();
    return result;
}

}  // namespace sidewall::simplify
