#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Named values on a surface, by triangle corner: linear over triangles, with jumps at creases and material
/// edges. What one time step leaves for the next: coverages, fluxes, how steeply they vary.
struct SurfaceField {
    std::vector<std::string> names;
    std::vector<std::vector<double>> corner;         ///< one list a name: corner k of triangle t at 3 t + k
    std::shared_ptr<const surface::RayScene> scene;  ///< of the surface's mesh; absent if there are no values
};

/// The field of values that are known by wedge.
/// \param scene  of \p mesh; built here if it is absent.
/// \param by_wedge  one list a name.
SurfaceField surface_field(const TriangleMesh& mesh, const flux::Wedges& wedges,
                           const std::vector<std::string>& names,
                           const std::vector<std::vector<double>>& by_wedge,
                           std::shared_ptr<const surface::RayScene> scene = nullptr);

/// Values at points near the surface, one list of \p names: those of the closest point of the field; 0 for
/// names it does not have. O(log n) a point, parallel, deterministic.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       std::span<const Vec3> points);

/// Values on another surface, one list of \p names by wedge of \p mesh. The look-up starts a little
/// inside each wedge's own fan, so that it finds values of its own side of a crease.
std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges);

/// For checkpoints, every bit kept: numbers as binary blobs, so only for JSON that is stored in a binary
/// form.
Json to_json(const SurfaceField& field);

/// \throws nlohmann exceptions or FileError if it is not what to_json made.
SurfaceField surface_field_from_json(const Json& json);

}  // namespace sidewall::app
