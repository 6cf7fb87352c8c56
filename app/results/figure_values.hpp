#pragma once
#include <memory>

#include "app/recipe/figure_names.hpp"
#include "app/results/metrology.hpp"

namespace sidewall::app {

/// Figures at a place or of a material, in the plane of [metrology] cut. Layers are cut once for all figures asked for.
class FigureReader {
  public:
    /// \param surface  as extracted from \p stack.
    /// \param open     the surface without closed voids, for openings; may be the surface itself.
    /// \pre all outlive the reader.
    FigureReader(const Recipe& recipe, const levelset::MaterialStack& stack, const TriangleMesh& surface,
                 const TriangleMesh& open);
    ~FigureReader();

    /// NaN where the figure does not exist. O(n) in triangles, but ler and lwr, which cut once a cell along the line:
    /// O(n cells).
    Measure at(const Figure& figure);

  private:
    struct Cuts;
    const Cuts& cuts();
    double value_of(const Figure& figure);

    const Recipe& recipe_;
    const levelset::MaterialStack& stack_;
    const TriangleMesh &surface_, &open_;
    std::unique_ptr<const Cuts> cuts_;
};

}  // namespace sidewall::app
