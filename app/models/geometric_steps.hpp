#pragma once
#include <any>
#include <optional>
#include <string>
#include <vector>

namespace sidewall::app {

/// The parameters of a step that only shapes the wafer and takes no time. Which of them a model has, its keys say.
struct GeometricStep {
    std::string material;                ///< that fills or coats
    double height = 0.0;                 ///< z, of planarize and fill
    double thickness = 0.0;              ///< of a film
    bool conformal = false;              ///< the film of a mask is as thick along every normal
    std::vector<std::string> materials;  ///< that a cut or strip takes away; empty: all, of a cut
    std::optional<double> depth;         ///< below z = 0, of a cut; absent: through
};

/// The geometric step whose parameters these are; nullptr for a model that takes time.
inline const GeometricStep* geometric_step(const std::any& parameters) {
    return std::any_cast<GeometricStep>(&parameters);
}

}  // namespace sidewall::app
