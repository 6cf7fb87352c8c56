#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/body_edges.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::levelset {

/// Speed by a parallel beam: V(n) = facing max(0, n . d) + always; d is the unit vector to its source.
struct BeamSpeed {
    double facing = 0.0, always = 0.0;  ///< length per time
};

/// Largest number of speed classes of a SpeedLaw.
inline constexpr std::size_t kSpeedClasses = 256;

/// The speed V of a surface at the samples of an extension, and its known properties. The functions are
/// called in parallel, with a sample's number and the layer that is assumed to be bare there.
struct SpeedLaw {
    /// V (length per time; positive grows, negative etches) if the surface's unit normal were \p normal.
    std::function<double(std::size_t sample, std::size_t layer, const Vec3& normal)> speed;
    bool depends_on_normal = false;  ///< V = V(n): evaluated at every node with its own normal
    /// The largest etch rate over all normals (length per time; 0 where V is nowhere negative). Set it if
    /// depends_on_normal, so that a body that etches at no normal is held in place; if empty, no body is
    /// inert. Otherwise V itself gives the rate.
    std::function<double(std::size_t sample, std::size_t layer)> max_etch_rate{};
    /// By sample: the surface's unit normal, about which V(n) is linearised for most nodes. Empty: V(n) is
    /// evaluated at all of them.
    std::vector<Eigen::Vector3f> normal{};
    /// By layer: bounds of |dH/dp| along the axes if H = |p| V(p/|p|) is not convex, V(n) being of one sign
    /// for all n; else empty.
    std::vector<Vec3> dissipation{};
    std::vector<Vec3> planes{};  ///< normals at which V may have a cusp, the slowest first: a crystal's faces
    std::vector<std::uint8_t> inert{};  ///< by layer: V is 0 wherever it is bare. Empty: unknown
    /// Set if V has the form of a BeamSpeed, so that V need not be evaluated at every node; else empty.
    std::function<BeamSpeed(std::size_t sample, std::size_t layer)> beam_speed{};
    Vec3 beam = Vec3::UnitZ();  ///< d of beam_speed
    /// By sample: samples of one class have the same V on the same layer, evaluated once. Empty: no classes.
    std::vector<std::uint8_t> speed_class{};
    bool same_growth = false;  ///< V >= 0 is the same on all layers: lower layers do not matter
    /// V also holds at sharp edges, which are kept; not if it comes from traced fluxes with yields by angle.
    bool keeps_edges = true;
};

/// What moves the surface in one time step: V and, by sample, the layers below it.
struct Motion {
    Extension extension;
    SpeedLaw law;  ///< at the extension's samples
    /// The motion of stack.coarser, with separate samples; null if there is no coarser level.
    std::shared_ptr<const Motion> coarser = nullptr;
};

/// The first sample of each speed class, by class; the number of samples for a class that has none.
/// \param speed_class  SpeedLaw::speed_class.
std::array<std::size_t, kSpeedClasses> first_of_classes(std::span<const std::uint8_t> speed_class);

/// The largest |V| on the surface, of exposed materials and of those less than a cell below, on all levels
/// where they count.
/// \throws NumericsError if a speed is not finite (the message tells where).
double max_speed(const MaterialStack& stack, const Motion& motion);

/// Largest change of speed in a coarser cell, as a share of the largest speed, by a straight line fitted to
/// the speeds of a leaf.
inline constexpr double kSpeedChange = 0.03;

/// By level except the coarsest: the columns in which the speed changes by over kSpeedChange of the largest
/// in a coarser cell along the surface; the present ones if nothing moves. To be called before the surface
/// moves.
std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion);

}  // namespace sidewall::levelset
