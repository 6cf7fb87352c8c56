#pragma once
#include <any>
#include <optional>
#include <string>
#include <vector>

namespace sidewall::app {

/// Parameters of a step that shapes the wafer and takes no process time. Each model has keys for some.
struct GeometricStep {
    std::string material;                ///< material that fills or coats
    double height = 0.0;                 ///< z of the new surface: planarize, fill
    double thickness = 0.0;              ///< thickness of the film
    bool conformal = false;              ///< mask: equal thickness along every normal, else a flat top
    std::vector<std::string> materials;  ///< materials that a cut or strip removes; empty: a cut removes all
    std::optional<double> depth;         ///< depth of a cut below z = 0; no value: through everything
};

/// The parameters of a geometric step; nullptr if they belong to a model that takes time.
inline const GeometricStep* geometric_step(const std::any& parameters) {
    return std::any_cast<GeometricStep>(&parameters);
}

}  // namespace sidewall::app
