#include "levelset/motion/geometric.hpp"

#include <limits>

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
            [](const Values& values, const Materials&, const levelset::Shape&,
               levelset::MaterialStack& stack) { levelset::planarize(stack, values.get<double>("height")); }};
}

ModelEntry fill() {
    return {"fill",
            "fills everything up to a height, closed voids included; takes no time",
            {material_key("what it is filled with"), height_key("z of the fill's surface")},
            nullptr,
            [](const Values& values, const Materials& materials, const levelset::Shape&,
               levelset::MaterialStack& stack) {
                levelset::fill(stack, id_of(values, materials), values.get<double>("height"));
            }};
}

ModelEntry strip() {
    return {"strip",
            "takes away all of a material; takes no time",
            {material_key("what goes")},
            nullptr,
            [](const Values& values, const Materials& materials, const levelset::Shape&,
               levelset::MaterialStack& stack) { levelset::strip(stack, id_of(values, materials)); }};
}

ModelEntry conformal() {
    return {"conformal",
            "coats everything, closed voids included, by the same thickness; takes no time",
            {material_key("of the film"), {"thickness", 0.0, "length", "of the film", required(kPositive)}},
            nullptr,
            [](const Values& values, const Materials& materials, const levelset::Shape&,
               levelset::MaterialStack& stack) {
                levelset::conformal(stack, id_of(values, materials), values.get<double>("thickness"));
            }};
}

ModelEntry mask() {
    return {"mask",
            "coats everything, closed voids excepted, with a film that has openings; takes no time",
            {material_key("of the film"),
             {"thickness", 0.0, "length", "of the film, above the highest point unless conformal",
              required(kPositive)},
             {"conformal", false, "", "as thick along every normal; else spun on to a flat top"}},
            nullptr,
            [](const Values& values, const Materials& materials, const levelset::Shape& pattern,
               levelset::MaterialStack& stack) {
                levelset::mask(stack, id_of(values, materials), pattern, values.get<double>("thickness"),
                               values.get<bool>("conformal"));
            },
            true};
}

ModelEntry cut() {
    return {"cut",
            "takes away what lies in openings, straight down and whatever lies on it; takes no time",
            {{"materials", std::vector<std::string>(), "", "what goes; all without it", {.material = true}},
             {"depth",
              std::optional<double>(),
              "length",
              "below z = 0, down to which it goes; needed where the substrate does",
              {.word = "through"}}},
            nullptr,
            [](const Values& values, const Materials& materials, const levelset::Shape& pattern,
               levelset::MaterialStack& stack) {
                std::vector<int> ids;
                for (const std::string& name : values.get<std::vector<std::string>>("materials"))
                    ids.push_back(*material_id(materials, name));
                for (const levelset::Layer& layer : stack.layers)
                    if (values.get<std::vector<std::string>>("materials").empty())
                        ids.push_back(layer.material);
                const auto& depth = values.get<std::optional<double>>("depth");
                levelset::cut(stack, ids, pattern,
                              depth ? -*depth : -std::numeric_limits<double>::infinity());
            },
            true};
}

}  // namespace sidewall::app
