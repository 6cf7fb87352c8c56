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

/// A speed that a parallel beam makes: V(n) = facing max(0, n . d) + always, d the unit vector towards its source.
struct BeamSpeed {
    double facing = 0.0, always = 0.0;  ///< length per time
};

/// The most speed classes that a SpeedLaw may have.
inline constexpr std::size_t kSpeedClasses = 256;

/// The speed V of a surface at the samples of an extension, and what is known of it. The functions are called in
/// parallel, with the number of a sample and a layer that is taken to be bare there.
struct SpeedLaw {
    /// Normal speed V (length per time; positive grows, negative etches) if the surface's unit normal were \p normal.
    std::function<double(std::size_t sample, std::size_t layer, const Vec3& normal)> speed;
    bool depends_on_normal = false;  ///< V = V(n): evaluated at every node with its own normal
    /// The largest etch rate (length per time, 0 where V is nowhere negative) over all normals. To be set where
    /// depends_on_normal: a body that etches at no normal is held in place. Otherwise V itself says so; empty: no
    /// body is taken for inert.
    std::function<double(std::size_t sample, std::size_t layer)> max_etch_rate{};
    /// By sample: the unit normal of the surface there, about which V(n) is expanded for most nodes; empty: V(n) is evaluated
    /// at all of them.
    std::vector<Eigen::Vector3f> normal{};
    /// By layer: bounds of |dH/dp| along the axes where V(n), of one sign for all n, makes H = |p| V(p/|p|) no
    /// convex function; else empty.
    std::vector<Vec3> dissipation{};
    std::vector<Vec3> planes{};  ///< normals at which V may have a cusp, the slowest first: a crystal's faces
    std::vector<std::uint8_t> inert{};  ///< by layer: V is 0 wherever it is bare. Empty: not known of any
    /// Where V has the form of a BeamSpeed, so that V need not be evaluated at every node; else empty.
    std::function<BeamSpeed(std::size_t sample, std::size_t layer)> beam_speed{};
    Vec3 beam = Vec3::UnitZ();  ///< d of beam_speed
    /// By sample: samples of one class have the same V on the same layer, which is evaluated once. Empty: each sample
    /// has its own.
    std::vector<std::uint8_t> speed_class{};
    bool same_growth = false;  ///< V is at least 0 and the same on all layers: none of them matters
    /// V holds at edges, which the surface keeps. Not where it comes of fluxes that depend on the angle of incidence.
    bool keeps_edges = true;
};

/// What moves the surface in one time step: V and, per sample, what lies below it.
struct Motion {
    Extension extension;
    SpeedLaw law;  ///< at the extension's samples
    /// The motion of stack.coarser, with samples of its own; null if there is no coarser level.
    std::shared_ptr<const Motion> coarser = nullptr;
};

/// The first sample of each speed class, by class; the number of samples for a class that has none.
/// \param speed_class  SpeedLaw::speed_class.
std::array<std::size_t, kSpeedClasses> first_of_classes(std::span<const std::uint8_t> speed_class);

/// The largest |V| on the surface, of exposed materials and of those less than a cell below, on all levels where they
/// count.
/// \throws NumericsError if a speed is not finite (the message tells where).
double max_speed(const MaterialStack& stack, const Motion& motion);

/// Share of the largest speed by which a straight line through the speeds of a leaf may rise a coarser cell.
inline constexpr double kSpeedChange = 0.03;

/// Columns in which the speed changes by more than kSpeedChange of the largest one in a coarser cell along the surface, by
/// level but the coarsest; if nothing moves, those that the level has. To be called before the surface moves.
std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion);

}  // namespace sidewall::levelset
