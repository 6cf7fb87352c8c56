#include "levelset/geometric.hpp"

#include "app/models/model.hpp"

// Steps that only shape: recipes name them like models, but they take no time.
namespace sidewall::app {
namespace {

int id_of(const Values& values, const Materials& materials) {
    return *material_id(materials, values.get<std::string>("material"));
}

Key height_key(const char* doc) {
    return {"height", 0.0, "length", doc, required()};
}

Key material_key(const char* doc) {
    return {"material", std::string(), "", doc, {.required = true, .material = true}};
}

}  // namespace

ModelEntry planarize() {
    return {"planarize",
            "polishes everything down to a height; takes no time",
            {height_key("z of the polished surface")},
            nullptr,
            [](const Values& values, const Materials&, levelset::MaterialStack& stack) {
                levelset::planarize(stack, values.get<double>("height"));
            }};
}

ModelEntry fill() {
    return {"fill",
            "fills everything up to a height, closed voids included; takes no time",
            {material_key("what it is filled with"), height_key("z of the fill's surface")},
            nullptr,
            [](const Values& values, const Materials& materials, levelset::MaterialStack& stack) {
                levelset::fill(stack, id_of(values, materials), values.get<double>("height"));
            }};
}

ModelEntry strip() {
    return {"strip",
            "takes away all of a material; takes no time",
            {material_key("what goes")},
            nullptr,
            [](const Values& values, const Materials& materials, levelset::MaterialStack& stack) {
                levelset::strip(stack, id_of(values, materials));
            }};
}

ModelEntry conformal() {
    return {"conformal",
            "coats everything, closed voids included, by the same thickness; takes no time",
            {material_key("of the film"), {"thickness", 0.0, "length", "of the film", required(kPositive)}},
            nullptr,
            [](const Values& values, const Materials& materials, levelset::MaterialStack& stack) {
                levelset::conformal(stack, id_of(values, materials), values.get<double>("thickness"));
            }};
}

}  // namespace sidewall::app
