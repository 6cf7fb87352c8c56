#include "app/process/run_options.hpp"

#include "surface/error.hpp"

namespace sidewall::app {

Model model_with_law(const Recipe& recipe, const CallerLaw& law, const Step& step) {
    Model model = *step.built;
    if (!law) return model;
    if (model.depends_on_normal)
        throw RecipeError(
            "{}: step {}: no other law can stand for a speed that turns with the normal, as that of {}",
            recipe.file, step.name, step.model);
    Model plain = model;
    model.speeds = [law, step, plain](std::span<const SurfacePoint> points) {
        return law(step, plain, points);
    };
    model.hints.inert.clear();  // these hints hold for the model's own speed only
    model.hints.beam_speed = nullptr;
    return model;
}

}  // namespace sidewall::app
