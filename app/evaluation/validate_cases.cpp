#include "app/evaluation/validate_cases.hpp"

#include <numbers>

// The table of `sidewall validate`: fluxes. A reference without a source has no place in it.
namespace sidewall::app {
namespace {

using Kind = ValidationReading::Kind;

constexpr const char* kMolecularFlow =
    "Clausing, Ann. Phys. 12, 961 (1932); Cole, Prog. Astronaut. Aeronaut. 51, 261 (1977)";
constexpr const char* kRings =
    "ring integral equation with closed-form view factors, extrapolated from two resolutions, to 0.1 % or better";
constexpr const char* kStrips =
    "radiosity of an endless trench by Hottel's crossed strings, 400 strips, exact to the digits shown";

// A film so slow that nothing moves: what arrives is looked at.
std::string still(const std::string& sticking, const std::string& flux) {
    return "[[step]]\nmodel = \"single_particle\"\nduration = 1.0\nrate = { Si = -1e-6 }\nsticking = " +
           sticking + "\n[flux]\n" + flux + "\n";
}

// A tube of radius 1 whose walls reflect and whose floor absorbs.
std::string tube(const std::string& length) {
    return "[domain]\nextent = [2.4, 2.4]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\ntop = -" +
           length + "\n[[layer]]\nmaterial = \"Mask\"\nshape = \"hole\"\ntop = 0.0\nradius = 1.0\n" +
           still("{ Si = 1.0, Mask = 0.0 }", "method = \"radiosity\"\nrays = 1_000_000");
}

// A hole of radius 1 in silicon.
std::string hole(const std::string& depth, const std::string& sticking) {
    return "[domain]\nextent = [2.4, 2.4]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = \"hole\"\nradius = 1.0\ndepth = " +
           depth + "\n" + still(sticking, "method = \"radiosity\"\nrays = 2_000_000");
}

// A trench of width 1 in silicon, a strip of it.
std::string trench(const std::string& depth, const std::string& sticking) {
    return "[domain]\nextent = [2.0, 0.4]\ngrid_spacing = 0.05\nboundary = [\"reflective\", \"periodic\"]\n"
           "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.0\ndepth = " +
           depth + "\n" + still(sticking, "rays = 2_000_000");
}

ValidationReading floor_flux(double reference, double bar, double below, double radius = 1e30) {
    return {.label = "flux at the floor",
            .kind = Kind::floor,
            .name = "flux_neutral",
            .reference = reference,
            .reference_bar = bar,
            .z_high = below,
            .radius = radius};
}

ValidationReading share(double reference) {
    return {.label = "share",
            .kind = Kind::share,
            .name = "flux_neutral",
            .reference = reference,
            .reference_bar = 1e-5,
            .opening = std::numbers::pi};
}

// Of a hole 10 deep, in a band of a twentieth of the depth; the bar is what the band's mean may differ by.
ValidationReading wall_flux(const char* label, double reference, double bar, double z) {
    return {.label = label,
            .kind = Kind::wall,
            .name = "flux_neutral",
            .reference = reference,
            .reference_bar = bar,
            .z_low = z - 0.25,
            .z_high = z + 0.25};
}

std::vector<ValidationCase> tubes_and_holes() {
    const std::string molecules =
        "molecules through a tube whose walls reflect all: share that reaches the far end";
    return {{"tube_1",
             molecules + ", length over radius 1",
             kMolecularFlow,
             "",
             tube("1.0"),
             true,
             {share(0.67198)}},
            {"tube_2",
             molecules + ", length over radius 2",
             kMolecularFlow,
             "",
             tube("2.0"),
             true,
             {share(0.51423)}},
            {"tube_4",
             molecules + ", length over radius 4",
             kMolecularFlow,
             "",
             tube("4.0"),
             true,
             {share(0.35657)}},
            {"hole_view",
             "a hole of radius 1 and depth 2 at sticking 1: mean flux within 0.3 of the floor's centre",
             "view factor of two coaxial discs of radius 0.3 and 1 at a distance of 2",
             "",
             hole("2.0", "1.0"),
             true,
             {floor_flux(0.197125, 0.0, -1.9, 0.3)}},
            {"hole_radiosity_0.1",
             "a hole of aspect ratio 5 (depth over diameter) at sticking 0.1",
             kRings,
             "",
             hole("10.0", "0.1"),
             true,
             {wall_flux("flux at the wall at 0.25 of the depth", 0.340341, 0.0008, -2.5),
              wall_flux("flux at the wall at 0.45 of the depth", 0.192689, 0.0004, -4.5),
              wall_flux("flux at the wall at 0.75 of the depth", 0.0983205, 0.0002, -7.5)}},
            {"hole_radiosity_0.01",
             "the same hole at sticking 0.01",
             kRings,
             "",
             hole("10.0", "0.01"),
             true,
             {wall_flux("flux at the wall at 0.25 of the depth", 0.780146, 0.0009, -2.5),
              wall_flux("flux at the wall at 0.45 of the depth", 0.701066, 0.0008, -4.5),
              wall_flux("flux at the wall at 0.75 of the depth", 0.632127, 0.0007, -7.5)}}};
}

std::vector<ValidationCase> trenches_and_beams() {
    return {
        {"trench_view",
         "an endless trench of width 1 and depth 2 at sticking 1: mean flux at the floor",
         "view factor of a strip and the opening above it, sqrt(1 + 4) - 2",
         "",
         trench("2.0", "1.0"),
         true,
         {floor_flux(0.236068, 0.0, -1.9)}},
        {"trench_radiosity_0.5",
         "the same trench at sticking 0.5",
         kStrips,
         "",
         trench("2.0", "0.5"),
         true,
         {{.label = "mean flux at the walls",
           .kind = Kind::wall,
           .name = "flux_neutral",
           .reference = 0.32053,
           .reference_bar = 1e-5},
          floor_flux(0.33376, 1e-5, -1.9)}},
        {"trench_radiosity_0.1",
         "the same trench at sticking 0.1",
         kStrips,
         "",
         trench("2.0", "0.1"),
         true,
         {floor_flux(0.69141, 1e-5, -1.9)}},
        {"half_sphere",
         "a half sphere at sticking 0.2: the flux is the same everywhere",
         "every point sees half of the others and half of the opening, so that flux = 1 / (1 + sticking)",
         "",
         "[domain]\nextent = [2.4, 2.4]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nshape = \"sphere\"\n"
         "subtract = true\nradius = 1.0\nz = 0.0\n" +
             still("0.2", "rays = 1_000_000"),
         true,
         {{.label = "mean flux, 0.3 and more below the rim",
           .kind = Kind::all,
           .name = "flux_neutral",
           .reference = 1.0 / 1.2,
           .z_high = -0.3}}},
        {"turning_beam",
         "a beam tilted by 30 degrees on a turning wafer: flux on a vertical wall",
         "mean over the azimuths of the beam's component across the wall, tan(30 degrees) / pi",
         "",
         "[domain]\nextent = [4.0, 0.8]\ngrid_spacing = 0.1\nboundary = \"periodic\"\n[[layer]]\nmaterial = \"Si\"\n"
         "shape = \"fin\"\nwidth = 1.0\nheight = 1.0\n[[step]]\nmodel = \"multi_particle\"\nduration = 1.0\n"
         "species = [{ name = \"beam\", kind = \"collimated\", source_exponent = 100000.0, tilt_deg = 30.0, rotating = "
         "true, rate = { Si = -1e-6 } }]\n[flux]\nrays = 1_000_000\n",
         true,
         {{.label = "flux at the walls",
           .kind = Kind::wall,
           .name = "flux_beam",
           .reference = 0.183776,
           .z_low = 0.2,
           .z_high = 0.8}}},
    };
}

}  // namespace

const std::vector<ValidationCase>& validation_cases() {
    static const std::vector<ValidationCase> cases = [] {
        std::vector<ValidationCase> all = tubes_and_holes();
        for (auto* part : {&trenches_and_beams, &validation_shapes, &validation_simulators})
            for (ValidationCase& one : (*part)()) all.push_back(std::move(one));
        return all;
    }();
    return cases;
}

}  // namespace sidewall::app
