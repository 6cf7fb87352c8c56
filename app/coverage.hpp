#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/output.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Coverages on a surface, by triangle corner: linear over triangles, with jumps at creases and material
/// edges.
struct CoverageField {
    TriangleMesh mesh;  ///< vertices and triangles only; empty before the first coverage
    std::vector<std::string> names;
    std::vector<std::vector<double>> corner;  ///< one list a name: corner k of triangle t at 3 t + k
};

/// The field of values that are known by wedge.
CoverageField coverage_field(const TriangleMesh& mesh, const flux::Wedges& wedges,
                             const std::vector<std::string>& names,
                             const std::vector<std::vector<double>>& by_wedge);

/// Values at points near the surface, one list of \p names: those of the closest point of the field; 0 for
/// names it does not have. O(n log n), parallel, deterministic.
std::vector<std::vector<double>> carry(const CoverageField& field, const std::vector<std::string>& names,
                                       std::span<const Vec3> points);

/// Values on another surface, one list of \p names by wedge of \p mesh. The look-up starts a little
/// inside each wedge's own fan, so that values do not leak over creases.
std::vector<std::vector<double>> carry(const CoverageField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges);

/// For checkpoints, every bit kept: numbers as binary blobs, so only for JSON that is stored in a binary
/// form.
Json to_json(const CoverageField& field);

/// \throws nlohmann exceptions or FileError if it is not what to_json made.
CoverageField coverage_from_json(const Json& json);

}  // namespace sidewall::app
