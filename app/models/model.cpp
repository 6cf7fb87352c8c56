#include "app/models/model.hpp"

#include <algorithm>

namespace sidewall::app {

ModelEntry isotropic();
ModelEntry directional();
ModelEntry single_particle();
ModelEntry multi_particle();
ModelEntry formula();
ModelEntry teos();
ModelEntry ald();
ModelEntry sf6_o2();
ModelEntry hbr_o2();
ModelEntry cf4_o2();
ModelEntry fluorocarbon();
ModelEntry ion_beam();
ModelEntry wet();
ModelEntry epitaxy();
ModelEntry planarize();
ModelEntry fill();
ModelEntry strip();
ModelEntry conformal();
ModelEntry mask();
ModelEntry cut();

const std::vector<ModelEntry>& models() {
    static const std::vector<ModelEntry> table = {
        isotropic(), directional(), single_particle(), multi_particle(), formula(),  teos(), ald(),
        sf6_o2(),    hbr_o2(),      cf4_o2(),          fluorocarbon(),   ion_beam(), wet(),  epitaxy(),
        planarize(), fill(),        strip(),           conformal(),      mask(),     cut()};
    return table;
}

Model still_model() {
    Model still;
    still.speed = [](const SurfacePoint&) { return 0.0; };
    return still;
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

std::vector<std::string> flux_names(const std::vector<flux::Species>& species) {
    std::vector<std::string> names;
    for (const flux::Species& s : species)
        for (std::string& name : flux::tally_names(s)) names.push_back(std::move(name));
    return names;
}

Key deposit_key(std::string& deposit) {
    return {"deposit", &deposit, "", "material of the film that grows; needed where a rate is positive",
            kMaterial};
}

Key coverage_tolerance_key(double& tolerance) {
    return {"coverage_tolerance", &tolerance, "",
            "fluxes and coverages are iterated at the start of a step until coverages change by less than "
            "this in the mean",
            within(1e-8, 1.0)};
}

std::optional<int> film(const std::string& deposit, const Materials& materials, bool grows) {
    if (grows && deposit.empty())
        throw KeyError("deposit", "missing: a positive rate grows a film; name it, e.g. deposit = \"SiO2\"");
    if (!grows && !deposit.empty())
        throw KeyError("deposit", "names a film, but no rate is positive; make one positive or drop deposit");
    return deposit.empty() ? std::nullopt : material_id(materials, deposit);
}

}  // namespace sidewall::app
