#include "surface/tetrahedra/tetrahedralize.hpp"

#include "surface/tetrahedra/tet_cut.hpp"
#include "surface/tetrahedra/tet_improve.hpp"
#include "surface/tetrahedra/tet_lattice.hpp"
#include "surface/tetrahedra/tet_volume.hpp"

namespace sidewall::surface {
namespace {

/// Living tetrahedra and their vertices, in their order.
TetMesh compact(const TetComplex& mesh, std::size_t regions) {
    TetMesh result;
    std::vector<std::uint32_t> number(mesh.point.size(), TetComplex::kNone);
    for (std::uint32_t t = 0; t < mesh.tet.size(); ++t) {
        if (!mesh.alive(t)) continue;
        Tetrahedron corners = mesh.tet[t];
        for (std::uint32_t& v : corners) {
            if (number[v] == TetComplex::kNone) {
                number[v] = static_cast<std::uint32_t>(result.vertices.size());
                result.vertices.push_back(mesh.point[v]);
            }
            v = number[v];
        }
        result.tetrahedra.push_back(corners);
        result.region.push_back(mesh.region[t]);
    }
    result.regions.resize(regions);
    return result;
}

}  // namespace

TetMesh tetrahedralize(std::span<const Front> fronts, const TetOptions& options) {
    TetComplex mesh = bisected_box(fronts, options);
    const int outside = mesh.outside;
    const auto progress = [&](int fronts_done) {
        constexpr double kLattice = 0.2;
        if (options.progress) options.progress(kLattice + (1.0 - kLattice) * fronts_done / outside);
    };
    progress(0);
    for (int k = outside - 1; k >= 0; --k) {
        cut_front(mesh, fronts, k, options);
        if (k + 1 == outside && !options.outside)
            for (std::uint32_t t = 0; t < mesh.tet.size(); ++t)
                if (mesh.alive(t) && mesh.region[t] == outside) mesh.remove_tet(t);
        improve(mesh, fronts, options);  // the next front cuts better ones better
        progress(outside - k);
    }
    if (!options.volume.empty()) match_volumes(mesh, options);
    return compact(mesh, fronts.size() + (options.outside ? 1 : 0));
}

}  // namespace sidewall::surface
