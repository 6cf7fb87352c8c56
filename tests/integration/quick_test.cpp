#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "app/process/simulation.hpp"
#include "tests/integration/run_program.hpp"

// Every shipped quick recipe in every mode of simplification, against bounds that the process sets.
using namespace sidewall;

namespace {

struct Bound {
    const char* measure;
    double least, most;
};

// Blanket rates times durations bound depths and films; masks only lose; walls lean as the process makes
// them. An undercut of less than a cell may come out negative by a part of one.
const std::map<std::string, std::vector<Bound>> kBounds = {
    // 200 cycles of 0.1 nm at the top, half of it half way down.
    {"ald_via", {{"film_top", 19.9, 20.1}, {"film_side", 8.0, 12.0}, {"film_bottom", 1.5, 3.5}}},
    {"ald_hole", {{"film_top", 22.0, 25.3}, {"film_side", 20.0, 25.3}, {"step_coverage_bottom", 0.9, 1.02}}},
    // 250 cycles of 0.106 nm where all sites are taken.
    {"ald_cavity", {{"film_top", 0.0255, 0.0270}, {"film_bottom", 0.010, 0.0270}}},
    {"ald_slot", {{"film_side", 0.029, 0.034}, {"film_bottom", 0.022, 0.026}}},
    // 0.4 s at 1 um/s beside the trench.
    {"apcvd_trench", {{"film_top", 0.36, 0.44}, {"step_coverage_bottom", 0.02, 0.5}}},
    // 160 and 150 s at 1 nm/s; what the beams leave of the ridge of mask is stripped.
    {"blazed_grating",
     {{"depth", 310.0 - 30.0, 310.0 + 30.0},
      {"removed_volume_Mask", 266000.0 * 0.99, 266000.0 * 1.01},
      {"removed_volume_SiO2", 441.0 * 21.0 * 200.0, 441.0 * 21.0 * 310.0}}},
    // Four cycles; a cycle's polymer must guard the walls, or the hole is as wide as it is deep. As a round
    // profile at a quarter of the spacing it is 2.3 wide.
    {"bosch_hole",
     {{"depth", 1.4, 2.2},
      {"cd_at_0.5", 1.8, 2.4},
      {"scallop_pitch", 0.2, 0.8},
      {"scallop_depth", 0.03, 0.3},
      // Without the film the etch would reach the domain's side, 1.0 from the mask's edge. One cycle gets to
      // 0.234 by a round profile at an eighth of the spacing, and a cell is 0.125.
      {"undercut", 0.0, 0.36},
      {"removed_volume_Mask", 0.5, 2.9},
      {"added_volume_Polymer", 0.1, 1.0}}},
    // <100> recedes by 23.9; the mask may lose its bared lower edges, dx^2 / 2 of 960.
    {"cantilever", {{"depth", 23.9 - 2.0, 23.9 + 2.0}, {"removed_volume_Si3N4", 0.0, 30720.0}}},
    // Like bosch_hole, but more of the floor sees the source.
    {"bosch_trench",
     {{"depth", 1.4, 2.6},
      {"cd_at_0.5", 1.8, 2.3},
      {"scallop_pitch", 0.2, 0.8},
      {"scallop_depth", 0.03, 0.3},
      {"undercut", 0.0, 0.36}}},
    // 0.15 of polysilicon in an opening of 0.2, walls that lean, and an over-etch at a twentieth of its rate.
    {"chlorine_lines",
     {{"depth", -0.0301, -0.0270},
      {"removed_volume_PolySi", 0.9 * 0.03, 1.1 * 0.03},
      {"removed_volume_SiO2", 0.0, 0.0005}}},
    // A cycle: 0.2 s through 0.1 of polymer, 0.8 s at 0.55.
    {"deposit_and_etch",
     {{"depth", 1.32 - 0.05, 1.32 + 0.05}, {"cd_at_0.25", 1.55, 1.8}, {"removed_volume_Mask", 0.0, 0.012}}},
    {"directional_hole_etch",
     {{"depth", 2.1 - 0.06, 2.1 + 0.06},
      {"cd_at_0.5", 2.15 - 0.125, 2.15 + 0.125},
      {"removed_volume_Mask", 0.0, 0.027}}},
    // 3 s at 1 um/s on the open floor, a little more where walls reflect ions.
    {"faraday_cage",
     {{"depth", 3.0 - 0.1, 3.0 + 0.3}, {"removed_volume_Si", 10.0 * 0.5 * 1.5, 10.0 * 0.5 * 3.0}}},
    // A liner of 15 that is then etched off upward faces.
    {"fin_on_wide_wafer", {{"film_side", 14.5, 15.2}, {"film_top", -0.1, 0.1}}},
    {"fin_deposition", {{"added_volume_Si3N4", 6.0, 8.1}, {"depth", -0.3, -0.2}}},
    // 7 of top at 1.6 and twice 7 of wall at 1.12, 1.2 wide: less what the facets cut.
    {"fin_epitaxy",
     {{"depth", -3.01, -2.99}, {"added_volume_SiGe", 20.0, 33.0}, {"added_volume_SiO2", 0.0, 0.2}}},
    {"fin_sequence", {{"depth", -42.01, -41.98}, {"removed_volume_Si", 0.0, 20.0}}},
    // Polished flat, with contacts through the oxide; nothing is left of the gate mask.
    {"finfet",
     {{"depth", -12.02, -11.98},
      {"added_volume_W", 4500.0, 9600.0},
      {"added_volume_TiN", 8000.0, 15400.0},
      {"added_volume_SiGe", 9000.0, 30000.0},
      {"added_volume_PolySi", 0.0, 1.0},
      {"added_volume_Mask", 0.0, 20.0}}},
    {"fluorocarbon_contact",
     {{"depth", 90.0, 185.0},
      {"cd_at_20", 50.0, 90.0},
      {"sidewall_angle", 80.0, 100.0},
      {"added_volume_Polymer", 1.0, 3e5},
      {"removed_volume_Mask", 0.0, 2.5e4}}},
    // An open wafer loses 0.155 um/s: chlorine on 0.65 of its sites, ions of a mean yield of 2.1.
    {"formula_etch",
     {{"depth", 1.3, 1.6},
      {"cd_at_0.2", 0.8 - 0.05, 1.05},
      {"sidewall_angle", 83.0, 91.0},
      {"undercut", 0.0, 0.15},
      {"removed_volume_Mask", 0.0, 0.004}}},
    // The step ends by its lowest point, in the foot of a wall: with an isotropic part feet are up to 0.1
    // cells deeper than the floor.
    {"gds_masked_etch",
     {{"depth", 0.5 - 0.1 * 0.125, 0.5 + 0.01 * 0.125},
      {"sidewall_angle", 80.0, 90.0},
      {"cd_at_0.1", 0.4, 0.6}}},
    // The mouth closes; the liner is 5 thick at the top.
    {"contact_round", {{"film_top", 99.0, 101.0}, {"added_volume_TiN", 1.5e5, 3e5}}},
    {"hole_deposition", {{"depth", 5.7, 6.0}, {"added_volume_SiO2", 11.0, 13.0}}},
    // The beam's own direction is 55 degrees from the horizontal; the floor leans less.
    {"ion_beam_trench",
     {{"depth", 0.06, 0.16}, {"cd_at_0.05", 0.1, 0.5}, {"added_volume_PolySi", 1e-5, 1e-3}}},
    {"isotropic_deposition", {{"depth", 6.4, 6.6}, {"added_volume_SiO2", 190.17 * 0.98, 190.17 * 1.02}}},
    // 80 cycles of 0.1 nm where all sites are taken, 0.98 of them at the top; the hole ends the film.
    {"memory_hole",
     {{"film_top", 7.7, 8.1},
      {"film_side", 3.0, 7.0},
      {"step_coverage_bottom", 0.05, 0.6},
      {"removed_volume_SiO2", 0.0, 100.0}}},
    // Like memory_hole, at the whole depth: half of the film half way down.
    {"memory_hole_round",
     {{"film_top", 7.7, 8.1}, {"film_side", 2.5, 5.0}, {"step_coverage_bottom", 0.0, 0.1}}},
    // All silicon-germanium is removed, three films of 8; wires stay.
    {"nanowires",
     {{"depth", -58.02, -57.98},
      {"removed_volume_SiGe", 69120.0 * 0.999, 69120.0 * 1.001},
      {"removed_volume_Si", 60000.0, 80000.0},
      {"added_volume_TiN", 25000.0, 40000.0},
      {"added_volume_PolySi", 0.0, 1.0}}},
    {"oxide_nitride_stack",
     {{"depth", 60.0, 100.0},
      {"cd_at_30", 65.0, 85.0},
      {"sidewall_angle", 75.0, 92.0},
      {"removed_volume_Mask", 0.0, 2250.0}}},
    {"pinch_off", {{"film_top", 1.37, 1.43}, {"film_side", 0.1, 0.4}, {"step_coverage_bottom", 0.1, 0.3}}},
    // Three lines of 12 out of four, two of them interrupted.
    {"quadruple_patterning",
     {{"depth", 24.0 - 1.5, 24.0 + 1.5},
      {"removed_volume_Si", 75000.0, 105000.0},
      {"removed_volume_Carbon", 28.0 * 96 * 64 * 0.99, 28.0 * 96 * 64 * 1.01}}},
    {"sf6o2_hole",
     {{"depth", 0.6, 1.1},
      {"cd_at_0.1", 0.3, 0.48},
      {"sidewall_angle", 85.0, 92.0},
      {"undercut", -0.03, 0.06},
      {"removed_volume_Mask", 0.0, 0.01}}},
    // An open wafer loses 0.17: theta 0.43 times a yield of 6.7 times 0.003 um/s. Four seeds of
    // lindstrom-turk scatter by 0.006 around 0.347.
    {"sheath_ions", {{"depth", 0.13, 0.18}, {"cd_at_0.1", 0.28, 0.37}, {"sidewall_angle", 85.0, 95.0}}},
    // Silicon-germanium at most at an open wafer's 9.75 nm/s, silicon hardly.
    {"sige_selective_etch", {{"recess_SiGe", 10.0, 39.0}, {"depth", 99.0, 101.0}}},
    // An open wafer would lose 1.2.
    {"simple_hole_etch",
     {{"depth", 0.4, 0.8},
      {"cd_at_0.2", 1.3, 1.8},
      {"undercut", 0.1, 0.45},
      {"removed_volume_Mask", 0.0, 0.02}}},
    // Nothing moves.
    {"neutral_transport", {{"depth", -1e-4, 1e-4}, {"cd_at_-0.5", 0.097, 0.103}}},
    {"slanted_lines", {{"depth", 0.03, 0.08}, {"removed_volume_Mask", 0.0, 0.001}}},
    // By characteristics (configs/validation/facet) the openings are 1.209 and 0.827.
    {"sputter_facet",
     {{"depth", 0.6 + 0.02, 0.6 + 0.1},
      {"cd_at_0.2", 1.209 - 0.05, 1.209 + 0.05},
      {"cd_at_0.4", 0.827 - 0.05, 0.827 + 0.05}}},
    // 0.25 s at 1 um/s on top; the floor sees a part of the target.
    {"sputter_deposition", {{"film_top", 0.23, 0.27}, {"step_coverage_bottom", 0.05, 0.7}}},
    // The rate falls from 0.04 to 0.031 um/s along x.
    {"sputter_map",
     {{"film_top", 12.0 * 0.031, 12.0 * 0.04 * 1.03},
      {"step_coverage_bottom", 0.1, 0.35},
      {"added_volume_SiO2", 0.0, 0.01}}},
    // 5 s at 0.6 of a third of the sites at most, a second late.
    {"surface_diffusion", {{"film_top", 0.5, 1.0}, {"step_coverage_bottom", 0.1, 0.9}}},
    {"teos_trench", {{"film_top", 0.28, 0.32}, {"step_coverage_bottom", 0.4, 0.8}}},
    {"teos_two_precursors", {{"film_top", 0.28, 0.32}, {"step_coverage_bottom", 0.5, 0.9}}},
    {"trench_deposition", {{"depth", 6.5, 7.2}, {"added_volume_SiO2", 170.0, 200.0}}},
    // trench_deposition over its width of 5.
    {"trench_profile", {{"depth", 6.5, 7.2}, {"added_volume_SiO2", 34.0, 40.0}}},
    {"wet_etch_pit",
     {{"depth", 1.594 - 0.1, 1.594 + 0.1},
      {"sidewall_angle", 54.74 - 2.0, 54.74 + 2.0},
      {"undercut", -0.25, 0.05},
      {"added_volume_Mask", 0.0, 0.038}}},
};

void check_all(const std::string& method) {
    std::set<std::string> seen;
    for (const auto& entry : std::filesystem::directory_iterator(SIDEWALL_SOURCE_DIR "/configs/quick")) {
        const std::string name = entry.path().stem().string();
        INFO(name << ", " << method);
        const auto bounds = kBounds.find(name);
        REQUIRE(bounds != kBounds.end());
        seen.insert(name);
        const test::Folder folder;
        const app::Recipe recipe = app::load_recipe(entry.path().string(), {"simplify.method=" + method});
        const app::Json metrology =
            app::run_recipe(recipe, {.output = folder.path, .quiet = true}).summary["metrology"];
        for (const Bound& bound : bounds->second) {
            INFO(bound.measure);
            REQUIRE(metrology[bound.measure].is_number());
            const double value = metrology[bound.measure].get<double>();
            CHECK(value >= bound.least);
            CHECK(value <= bound.most);
        }
    }
    CHECK(seen.size() == kBounds.size());
}

}  // namespace

TEST_CASE("every quick recipe ends with physical metrology, raw", "[slow]") {
    check_all("none");
}

TEST_CASE("every quick recipe ends with physical metrology, lindstrom-turk", "[slow]") {
    check_all("lindstrom-turk");
}

TEST_CASE("every quick recipe ends with physical metrology, region-bounded", "[slow]") {
    check_all("region-bounded");
}
