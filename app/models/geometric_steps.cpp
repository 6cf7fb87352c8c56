#include "app/models/geometric_steps.hpp"

#include "app/models/model.hpp"
#include "levelset/motion/geometric.hpp"

// Steps that change the wafer's shape and take no process time. Recipes name them like models.
namespace sidewall::app {
namespace {

using levelset::MaterialStack;
using levelset::Shape;

int id_of(const GeometricStep& step, const Materials& materials) {
    return *material_id(materials, step.material);
}

Key height_key(GeometricStep& p, const char* doc) {
    return {"height", &p.height, "length", doc, required()};
}

Key thickness_key(GeometricStep& p, const char* doc) {
    return {"thickness", &p.thickness, "length", doc, required(kPositive)};
}

Key material_key(GeometricStep& p, const char* doc) {
    return {"material", &p.material, "", doc, required(kMaterial)};
}

using Apply = void (*)(const GeometricStep&, const Materials&, const Shape&, MaterialStack&);

ModelEntry geometric_entry(std::string name, const std::string& doc, std::vector<Key> (*keys)(GeometricStep&),
                           Apply apply, bool patterned = false) {
    return {.name = std::move(name),
            .doc = doc + "; takes no time",
            .defaults = GeometricStep(),
            .keys = [keys](std::any& p) { return keys(std::any_cast<GeometricStep&>(p)); },
            .apply = apply,
            .patterned = patterned};
}

}  // namespace

ModelEntry planarize() {
    return geometric_entry(
        "planarize", "polishes everything down to a height",
        [](GeometricStep& p) { return std::vector<Key>{height_key(p, "z of the polished surface")}; },
        [](const GeometricStep& p, const Materials&, const Shape&, MaterialStack& stack) {
            levelset::planarize(stack, p.height);
        });
}

ModelEntry fill() {
    return geometric_entry(
        "fill", "fills everything up to a height, closed voids included",
        [](GeometricStep& p) {
            return std::vector<Key>{material_key(p, "material of the fill"),
                                    height_key(p, "z of the fill's surface")};
        },
        [](const GeometricStep& p, const Materials& materials, const Shape&, MaterialStack& stack) {
            levelset::fill(stack, id_of(p, materials), p.height);
        });
}

ModelEntry strip() {
    return geometric_entry(
        "strip", "takes away all of a material, or of several",
        [](GeometricStep& p) {
            Rule rule = required(kMaterial);
            rule.or_one = true;
            return std::vector<Key>{
                {"material", &p.materials, "", "material to remove, or a list of several", rule}};
        },
        [](const GeometricStep& p, const Materials& materials, const Shape&, MaterialStack& stack) {
            for (const std::string& name : p.materials) levelset::strip(stack, *material_id(materials, name));
        });
}

ModelEntry conformal() {
    return geometric_entry(
        "conformal", "coats everything, closed voids included, with a film of the same thickness",
        [](GeometricStep& p) {
            return std::vector<Key>{material_key(p, "material of the film"),
                                    thickness_key(p, "thickness of the film")};
        },
        [](const GeometricStep& p, const Materials& materials, const Shape&, MaterialStack& stack) {
            levelset::conformal(stack, id_of(p, materials), p.thickness);
        });
}

ModelEntry mask() {
    return geometric_entry(
        "mask", "coats everything, closed voids excepted, with a film that has openings",
        [](GeometricStep& p) {
            return std::vector<Key>{
                material_key(p, "material of the film"),
                thickness_key(p,
                              "thickness of the film above the highest point of the wafer, or along the "
                              "normal if conformal"),
                {"conformal", &p.conformal, "",
                 "true: the film is equally thick along every normal; false: it is spun on, with a flat top"}};
        },
        [](const GeometricStep& p, const Materials& materials, const Shape& pattern, MaterialStack& stack) {
            levelset::mask(stack, id_of(p, materials), pattern, p.thickness, p.conformal);
        },
        true);
}

ModelEntry cut() {
    return geometric_entry(
        "cut", "removes material straight down in openings, also from under other materials",
        [](GeometricStep& p) {
            return std::vector<Key>{
                {"materials", &p.materials, "", "materials to remove; empty: all", kMaterial},
                {"depth", &p.depth, "length",
                 "depth below z = 0 down to which material is removed; required if the substrate is removed",
                 or_word("through")}};
        },
        [](const GeometricStep& p, const Materials& materials, const Shape& pattern, MaterialStack& stack) {
            std::vector<int> ids;
            for (const std::string& name : p.materials) ids.push_back(*material_id(materials, name));
            for (const levelset::Layer& layer : stack.layers)
                if (p.materials.empty()) ids.push_back(layer.material);
            levelset::cut(stack, ids, pattern, p.depth ? -*p.depth : -kInfinity);
        },
        true);
}

}  // namespace sidewall::app
