#include "app/models/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sidewall::app {
namespace {

// 1 nm/s in the recipe's length per time.
double nm_per_s(const DomainSection& domain) {
    return 1e-9 * seconds_in(domain.time_unit) / metres_in(domain.length_unit);
}

}  // namespace

ModelEntry isotropic();
ModelEntry directional();
ModelEntry single_particle();
ModelEntry multi_particle();
ModelEntry teos();
ModelEntry ald();
ModelEntry sf6_o2();
ModelEntry hbr_o2();
ModelEntry fluorocarbon();
ModelEntry ion_beam();
ModelEntry wet();
ModelEntry epitaxy();
ModelEntry planarize();
ModelEntry fill();
ModelEntry strip();
ModelEntry conformal();

const std::vector<ModelEntry>& models() {
    static const std::vector<ModelEntry> table = {
        isotropic(), directional(), single_particle(), multi_particle(), teos(), ald(),
        sf6_o2(),    hbr_o2(),      fluorocarbon(),    ion_beam(),       wet(),  epitaxy(),
        planarize(), fill(),        strip(),           conformal()};
    return table;
}

const ModelEntry* find_model(std::string_view name) {
    const auto found = std::find_if(models().begin(), models().end(),
                                    [&](const ModelEntry& model) { return model.name == name; });
    return found == models().end() ? nullptr : &*found;
}

std::vector<std::string> model_names() {
    std::vector<std::string> names;
    for (const ModelEntry& model : models()) names.push_back(model.name);
    return names;
}

Model make_model(const Step& step, const Materials& materials) {
    const ModelEntry* model = find_model(step.model);
    if (model == nullptr) throw KeyError("model", "must be one of the models that `sidewall models` lists");
    // A geometric step takes no time and moves nothing by a speed.
    return model->make ? model->make(step.values, materials) : Model{};
}

Model make_model(const Step& step, const Materials& materials, const DomainSection& domain) {
    Model model = make_model(step, materials);
    for (const flux::Species& species : model.species)
        for (int axis = 0; axis < 2; ++axis) {
            const bool mirrored =
                domain.boundary[static_cast<std::size_t>(axis)] == levelset::Side::reflective;
            if (mirrored && !species.rotating && std::abs(species.beam[axis]) > 1e-9)
                throw KeyError(
                    "tilt_deg",
                    fmt::format("tilts the beam across {}, where reflective sides would mirror it: set "
                                "[domain] boundary to periodic there",
                                axis == 0 ? "x" : "y"));
        }
    if (model.in_nm_per_s) {
        model.speed = [speed = model.speed, unit = nm_per_s(domain)](const SurfacePoint& point) {
            return unit * speed(point);
        };
        if (model.max_etch_rate)
            model.max_etch_rate = [rate = model.max_etch_rate, unit = nm_per_s(domain)](
                                      const SurfacePoint& point) { return unit * rate(point); };
        if (model.max_speed) *model.max_speed *= nm_per_s(domain);
        for (Vec3& bound : model.dissipation) bound *= nm_per_s(domain);
        model.in_nm_per_s = false;
    }
    return model;
}

std::vector<std::string> flux_names(const std::vector<flux::Species>& species) {
    std::vector<std::string> names;
    for (const flux::Species& s : species)
        for (std::string& name : flux::tally_names(s)) names.push_back(std::move(name));
    return names;
}

Key deposit_key() {
    return {"deposit",
            std::string(),
            "",
            "material of the film that grows; needed where a rate is positive",
            {.material = true}};
}

std::optional<int> film(const Values& values, const Materials& materials, bool grows) {
    const auto& name = values.get<std::string>("deposit");
    if (grows && name.empty())
        throw KeyError("deposit", "missing: a positive rate grows a film; name it, e.g. deposit = \"SiO2\"");
    if (!grows && !name.empty())
        throw KeyError("deposit", "names a film, but no rate is positive; make one positive or drop deposit");
    return name.empty() ? std::nullopt : material_id(materials, name);
}

}  // namespace sidewall::app
