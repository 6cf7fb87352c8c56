#include "app/evaluation/validate_cases.hpp"

// Runs whose final shape is known: from closed forms, and from another simulator.
namespace sidewall::app {
namespace {

ValidationReading measured(const std::string& label, const std::string& unit, const std::string& name,
                           double reference, double bar) {
    return {.label = label,
            .unit = unit,
            .name = name,
            .reference = reference,
            .reference_bar = bar,
            .length = unit == "um"};
}

constexpr const char* kEvenFilm = R"([domain]
extent = [10.0, 1.0]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
top = -2.0
width = 4.0
depth = 8.0
[[step]]
model = "isotropic"
duration = 1.5
rate = 1.0
deposit = "SiO2"
[advection]
scheme = "weno5"
time_integration = "rk3"
[metrology]
measures = ["depth", "cd"]
cd_depths = [1.0, 5.0]
)";

constexpr const char* kMaskedBeam = R"([domain]
extent = [3.6, 3.6]
grid_spacing = 0.06
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "hole"
thickness = 0.6
radius = 1.0
[[step]]
model = "directional"
duration = 3.0
directional = { Si = -1.0 }
isotropic = { Si = -0.05 }
[metrology]
measures = ["depth", "cd"]
cd_depths = [0.5, 1.5, 2.5]
)";

constexpr const char* kPit = R"([domain]
extent = [10.0, 10.0]
grid_spacing = 0.125
time_unit = "min"
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "mask"
thickness = 0.6
polygons = [{ points = [-3.0, -3.0, 3.0, -3.0, 3.0, 3.0, -3.0, 3.0] }]
[[step]]
model = "wet"
duration = 4.0
material = "Si"
r100 = 0.797
r110 = 1.455
r111 = 0.005
r311 = 1.436
[metrology]
measures = ["depth", "sidewall_angle", "cd"]
cd_depths = [1.0, 2.0]
)";

constexpr const char* kFacet = R"([domain]
extent = [2.0, 0.1]
grid_spacing = 0.0125
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
top = -0.8
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.8
width = 0.8
[[step]]
model = "ion_beam"
duration = 20.0
rate = { Mask = 0.005, Si = 0.0 }
ion_exponent = 100000.0
reflect_from_deg = 89.0
[flux]
rays = 30_000
stages = "all"
[advection]
time_integration = "rk3"
[metrology]
measures = ["depth", "cd"]
cd_depths = [0.15, 0.2, 0.3]
)";

constexpr const char* kTrench = R"([domain]
extent = [10.08, 1.92]
grid_spacing = 0.24
boundary = ["reflective", "reflective"]
[[layer]]
material = "Si"
shape = "trench"
width = 4.0
depth = 8.0
[[step]]
model = "single_particle"
duration = 5.0
rate = 1.0
sticking = 0.1
deposit = "SiO2"
[flux]
rays = 100_000
[metrology]
measures = ["depth", "cd"]
cd_depths = [4.0, 6.0]
)";

constexpr const char* kHole = R"([domain]
extent = [0.48, 0.48]
grid_spacing = 0.03
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "hole"
thickness = 1.2
radius = 0.2
taper_deg = 1.193
position = [-0.24, -0.24]
[[step]]
model = "sf6_o2"
duration = 60.0
ion_flux = 10.0
etchant_flux = 4500.0
oxygen_flux = 800.0
ion_exponent = 1000.0
removal_yield = 2.0
coverage_beta = false
[flux]
rays = 30_000
averaging = 0.06
[simplify]
l_max = 0.045
max_error = 0.0006
[metrology]
measures = ["depth", "cd"]
cd_depths = [0.5, 1.5, 2.0]
cut = "y=-0.2399"
)";

}  // namespace

std::vector<ValidationCase> validation_shapes() {
    return {
        {"even_film",
         "a film as thick everywhere, 1.5 um in a trench 4 um wide and 8 um deep",
         "exact offset of the surface: flats move by 1.5, the edges become arcs of radius 1.5",
         "The openings are between the walls, 1 um, and between the arcs 1 um above the former edge.",
         kEvenFilm,
         false,
         {measured("floor, below z = 0", "um", "depth", 8.5, 0.0),
          measured("opening between the walls", "um", "cd_at_5", 1.0, 0.0),
          measured("opening between the arcs", "um", "cd_at_1", 1.763932, 0.0)}},
        {"masked_beam",
         "a hole etched through an inert mask by a beam with a slow isotropic part, 3 s",
         "closed form: floor at 1.05 x 3 um, wall radius at depth d 1 + 0.05 (3 - d / 1.05) um",
         "",
         kMaskedBeam,
         false,
         {measured("depth", "um", "depth", 3.15, 0.0),
          measured("opening at 0.5 um", "um", "cd_at_0.5", 2.252381, 0.0),
          measured("opening at 1.5 um", "um", "cd_at_1.5", 2.157143, 0.0),
          measured("opening at 2.5 um", "um", "cd_at_2.5", 2.061905, 0.0)}},
        {"koh_pit",
         "silicon (100) in 30 % KOH at 70 degrees C for 4 min through a window 6 um wide",
         "rates of Sato et al., Sens. Actuators A 64, 87 (1998); between these the crystal's angles give a frustum whose "
         "walls stand at 54.7356 degrees",
         "(100) 0.797, (110) 1.455, (111) 0.005, (311) 1.436 um/min. The volume is known but for what the mask's edge "
         "hides.",
         kPit,
         false,
         {measured("depth", "um", "depth", 3.188, 0.0),
          measured("angle of the walls", "degree", "sidewall_angle", 54.7356, 0.0),
          measured("opening at 1 um", "um", "cd_at_1", 4.634776, 0.0),
          measured("opening at 2 um", "um", "cd_at_2", 3.220563, 0.0),
          measured("volume of the pit", "um^3", "removed_volume_Si", 51.30733, 0.0)}},
        {"facet",
         "a facet that vertical ions of yield (1 + 9.3 sin^2) cos make of a mask's edge",
         "exact solution of h_t + H(h_x) = 0 by characteristics, H(q) = (1 + q^2)^(-1/2) + 9.3 q^2 (1 + q^2)^(-3/2): where the "
         "slope is q the surface lies at x = H'(q), depth H(q) - q H'(q), times what a flat mask loses",
         "The yield's form is that of Belen et al., J. Vac. Sci. Technol. A 23, 99 (2005); ions are parallel and none are "
         "reflected. A flat mask loses 0.1 um, the opening was 0.8 um wide.",
         kFacet,
         true,
         {measured("opening at 0.15 um", "um", "cd_at_0.15", 1.328852, 0.0),
          measured("opening at 0.2 um", "um", "cd_at_0.2", 1.208579, 0.0),
          measured("opening at 0.3 um", "um", "cd_at_0.3", 1.000559, 0.0)}},
    };
}

std::vector<ValidationCase> validation_simulators() {
    return {
        {"trench_deposition",
         "a trench filled at sticking 0.1 for 5 s, after it has closed over a void",
         "another simulator, ViennaPS 4.4, 1000 rays a point, dx 0.24 um, its triangle tracer; the bar is the difference to "
         "its disk tracer",
         "",
         kTrench,
         true,
         {measured("floor of the void, below z = 0", "um", "depth", 6.754, 0.049),
          measured("width of the void at 4 um", "um", "cd_at_4", 1.649, 0.055),
          measured("width of the void at 6 um", "um", "cd_at_6", 1.758, 0.065)}},
        {"sf6o2_hole",
         "a hole etched in silicon by an SF6/O2 plasma for 60 s under a tapered mask",
         "another simulator, ViennaPS 4.4, dx 0.03 um, with the model and parameters of Belen et al., J. Vac. Sci. Technol. "
         "A 23, 99 (2005)",
         "That simulator leaves the sticking coefficients out of the coverages and averages fluxes over two cells; so does "
         "this recipe. Its own error is not known. A quarter of the hole is run, between mirrors.",
         kHole,
         true,
         {measured("depth", "um", "depth", 2.448, 0.0),
          measured("opening at 0.5 um", "um", "cd_at_0.5", 0.374, 0.0),
          measured("opening at 1.5 um", "um", "cd_at_1.5", 0.348, 0.0),
          measured("opening at 2 um", "um", "cd_at_2", 0.328, 0.0)}},
    };
}

}  // namespace sidewall::app
