#include "tests/flux/traces.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {

FluxResult trace(const TriangleMesh& mesh, std::array<Boundary, 2> boundary, const Species& species,
                 const TraceOptions& options, std::span<const std::int32_t> materials) {
    const surface::RayScene scene(mesh);
    return trace_flux(mesh, scene, lateral_box(mesh, boundary), species, materials,
                      make_wedges(mesh, materials), options);
}

void check_balance(const FluxResult& result) {
    CHECK(result.leaked == 0);
    CHECK(result.emitted == result.absorbed + result.escaped);
    CHECK(result.ledger.balanced());
    CHECK(result.redeposited.balanced());
}

Mean mean_flux(const TriangleMesh& mesh, const FluxResult& result,
               const std::function<bool(std::size_t)>& chosen) {
    double area = 0.0, sum = 0.0, variance = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!chosen(t)) continue;
        const double a = triangle_area(mesh, t);
        area += a;
        sum += a * result.triangle.flux[t];
        variance += a * a * result.triangle.error[t] * result.triangle.error[t];
    }
    return {sum / area, std::sqrt(variance) / area};
}

}  // namespace sidewall::flux
