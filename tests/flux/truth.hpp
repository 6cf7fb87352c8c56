#pragma once
#include <functional>
#include <vector>

// Converged quadratures that flux tests compare with.
namespace sidewall::flux {

/// Probability that a molecule passes a tube of the given length and radius 1 whose wall re-emits diffusely
/// what does not stick: Clausing's integral equation (1932), collocated at the middle of \p cells rings.
/// Second order in the cells' size.
double clausing_transmission(double length, int cells, double sticking);

/// Richardson's extrapolation of the above; good to 1e-6.
double clausing_transmission(double length, double sticking = 0.0);

/// View factor from a horizontal element \p offset from the axis, \p depth below a disk of radius 1 (Howell,
/// configuration factor B-13).
double disk_view(double depth, double offset);

/// Flux in an infinitely long trench of width 1, one sticking probability: exact view factors between strips
/// (Hottel's crossed strings), radiosity on each constant.
struct TrenchFlux {
    double wall_mean = 0.0, floor_mean = 0.0;
    std::vector<double> wall, floor;  ///< mean flux of equal strips, downwards and across
};

/// Flux at a position in [0, 1] along the strips: linear between their middles.
double at_position(const std::vector<double>& strips, double position);

/// What emits: the opening (a thermal source), or the floor alone, by a cosine law of density 1. The floor's
/// own emission does not count as an arrival.
enum class Emitter { opening, floor };

TrenchFlux trench_flux(double depth, double sticking, int wall_strips, int floor_strips,
                       Emitter emitter = Emitter::opening);

/// Flux in a closed cylinder of radius 1 below an open plane, a thermal source and one sticking probability:
/// rings and annuli of constant flux, exact exchange areas between coaxial disks.
struct CylinderFlux {
    double floor_mean = 0.0;
    std::vector<double> wall;  ///< mean flux of equal rings, downwards
};

CylinderFlux cylinder_flux(double depth, double sticking, int rings, int annuli = 8);

/// Composite Simpson rule.
double integral(double from, double to, const std::function<double(double)>& f, int intervals = 4000);

}  // namespace sidewall::flux
