#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/block.hpp"
#include "levelset/motion/sample_index.hpp"
#include "levelset/motion/sample_speeds.hpp"
#include "levelset/motion/upwind.hpp"

// Hamiltonians H = V |grad phi| of eight neighbouring nodes at once.
namespace sidewall::levelset {

template <class SpeedOf>
double hamiltonian(const Vec3& p, SpeedOf&& speed) {
    const double length = p.norm();
    return length > 0.0 ? length * speed(Vec3(p / length)) : 0.0;
}

// Step of the central difference for |dH/dp|, as a share of |p| (H has kinks, and is homogeneous in p); and
// the least |p|.
inline constexpr double kShift = 1e-3, kLeastGradient = 1e-6;

// Limits H to the given sign: dissipation must not turn an etch into growth, nor the reverse.
inline double with_sign(double sign, double h) {
    return sign <= 0.0 ? std::min(h, 0.0) : std::max(h, 0.0);
}

/// Godunov's flux for V(n) given by \p speed_of(normal) at one node, from its one-sided gradients: along each
/// axis in turn the least H between the two where phi is convex, the largest where it is concave (Osher and
/// Shu, SIAM J. Numer. Anal. 28 (1991) 907). If the gradients hardly differ, its linear form; else a search
/// over both ends and the middle, which bounds the flux by values of H.
template <class SpeedOf>
float godunov(const Vec3& minus, const Vec3& plus, SpeedOf&& speed_of) {
    constexpr double kSmooth = 0.1;  // of |p|
    constexpr int kParts = 2;
    const Vec3 mean = 0.5 * (minus + plus), rise = plus - minus;
    const double least = kLeastGradient + kSmooth * mean.norm();
    if (rise.cwiseAbs().maxCoeff() <= least) {
        const double shift = std::max(0.1 * rise.cwiseAbs().maxCoeff(), kShift * least),
                     h = hamiltonian(mean, speed_of);
        double flux = h;
        for (int axis = 0; axis < 3; ++axis) {
            if (rise[axis] == 0.0) continue;
            Vec3 beside = mean;
            beside[axis] += shift;
            flux -= 0.5 * std::abs(hamiltonian(beside, speed_of) - h) / shift * rise[axis];
        }
        return static_cast<float>(with_sign(h, flux));
    }
    // Axes along which the gradients hardly differ are evaluated at the mean.
    int parts[3];
    for (int axis = 0; axis < 3; ++axis) parts[axis] = std::abs(rise[axis]) > 1e-3 * least ? kParts : 0;
    const auto place = [&](int axis, int part) {
        return parts[axis] == 0 ? mean[axis] : minus[axis] + rise[axis] * part / kParts;
    };
    const auto better = [&](int axis, double a, double b) {
        return rise[axis] > 0.0 ? std::min(a, b) : std::max(a, b);
    };
    double of_x = 0.0, of_y = 0.0, of_z = 0.0;
    for (int i = 0; i <= parts[0]; ++i) {
        for (int j = 0; j <= parts[1]; ++j) {
            for (int k = 0; k <= parts[2]; ++k) {
                // phi is a distance: only corners of the search box have steeper gradients.
                const Vec3 p(place(0, i), place(1, j), place(2, k));
                const double h = hamiltonian(Vec3(p / std::max(1.0, p.norm())), speed_of);
                of_z = k == 0 ? h : better(2, of_z, h);
            }
            of_y = j == 0 ? of_z : better(1, of_y, of_z);
        }
        of_x = i == 0 ? of_y : better(0, of_x, of_y);
    }
    return static_cast<float>(of_x);
}

// At a kink first differences along an axis differ by more than this. They are used there, as higher-order
// schemes may miss the normals between the two sides of an edge, so that no facet begins.
inline constexpr double kKink = 0.2;
// Cells: values farther from the front are set anew by re-distancing before the front reaches them.
inline constexpr float kNearFront = 1.5f;

/// Linear form of Godunov's flux for the linearised speed V(n) = speed + slope . (n - normal).
/// \returns false if n is too far from the normal for that.
inline bool expanded(const Vec3& minus, const Vec3& plus, const Vec3& normal, double speed, const Vec3& slope,
                     float& flux) {
    constexpr double kNear = 0.05;
    const Vec3 mean = 0.5 * (minus + plus);
    const double length = std::max(mean.norm(), kLeastGradient);
    const Vec3 n = mean / length, off = n - normal;
    if (off.squaredNorm() > kNear * kNear) return false;
    const double v = speed + slope.dot(off);
    const Vec3 along = v * n + slope - slope.dot(n) * n;  // dH/dp
    flux = static_cast<float>(with_sign(v, length * v - 0.5 * along.cwiseAbs().dot(plus - minus)));
    return true;
}

/// H at an edge between two planes that V(n) opens with a new facet, from first differences at a node of a
/// block: the least H (convex edge) or the largest (hollow edge) along the chord between the planes'
/// gradients.
/// \returns false if there is no edge, or H is extreme at an end of the chord: no facet opens.
template <int R, class SpeedOf>
bool opened_edge(const float* v, float inv_dx, SpeedOf&& speed_of, float& flux) {
    constexpr int kPlaces = 6;
    Vec3 minus, plus;
    for (int axis = 0; axis < 3; ++axis) {
        const std::ptrdiff_t stride = Block<R>::kStride[axis];
        minus[axis] = static_cast<double>((v[0] - v[-stride]) * inv_dx);
        plus[axis] = static_cast<double>((v[stride] - v[0]) * inv_dx);
    }
    const Vec3 rise = plus - minus;
    if (rise.cwiseAbs().maxCoeff() <= kKink) return false;
    // The gradients of two planes are the ends of a diagonal of the box between minus and plus.
    const bool convex = rise.sum() > 0.0;
    double best = 0.15;
    Vec3 from = Vec3::Zero(), to = Vec3::Zero();
    for (int diagonal = 0; diagonal < 4; ++diagonal) {
        Vec3 a = minus, b = plus;
        for (int axis = 1; axis < 3; ++axis)
            if (diagonal >> (axis - 1) & 1) std::swap(a[axis], b[axis]);
        const double off = std::max(std::abs(a.norm() - 1.0), std::abs(b.norm() - 1.0));
        if (off < best) best = off, from = a, to = b;
    }
    if (from == to) return false;
    const auto better = [&](double a, double b) { return convex ? std::min(a, b) : std::max(a, b); };
    const double ends = better(hamiltonian(from, speed_of), hamiltonian(to, speed_of));
    double h = ends;
    for (int n = 1; n < kPlaces; ++n)
        h = better(h, hamiltonian(Vec3(from + (to - from) * n / kPlaces), speed_of));
    flux = static_cast<float>(h);
    return h != ends;
}

/// Lax-Friedrichs flux for V(n) given by \p speed_of(normal) at one node, from its one-sided gradients.
/// \param bounds  of |dH/dp| by axis.
template <class SpeedOf>
float lax_friedrichs(const Vec3& minus, const Vec3& plus, const Vec3& bounds, SpeedOf&& speed_of) {
    const double mean = hamiltonian(Vec3(0.5 * (minus + plus)), speed_of);
    const double flux = mean - 0.5 * bounds.dot(plus - minus);
    // H has the sign of V: dissipation alone would fill a corner that an etch leaves, or erode one that
    // grows. Midway between two fronts the mean is 0, and both sides give the sign.
    const double sign = mean != 0.0 ? mean : hamiltonian(minus, speed_of) + hamiltonian(plus, speed_of);
    return static_cast<float>(sign < 0.0 ? std::min(flux, 0.0) : std::max(flux, 0.0));
}

/// Whether a crystal's slow face is near the normals between one-sided gradients: V changes by more than
/// twice its value per radian, so that a small error of the normal moves the front far.
template <class SpeedOf>
bool beside_slow_face(const Vec3& minus, const Vec3& plus, SpeedOf&& speed_of) {
    constexpr double kTilt = 0.1, kSteep = 2.0, kSame = 0.1;
    // Ends and middles of the box between the gradients; middles alone along thin axes. A face of a pit's
    // tip, where four meet, lies in the middle of one axis.
    for (int place = 0; place < 27; ++place) {
        const int part[3] = {place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1};
        Vec3 p;
        bool again = false;
        for (int axis = 0; axis < 3; ++axis) {
            const double half = 0.5 * (plus[axis] - minus[axis]);
            p[axis] = 0.5 * (minus[axis] + plus[axis]) + part[axis] * half;
            again = again || (part[axis] != 0 && 2.0 * std::abs(half) < kSame);
        }
        if (again || p.norm() < kSame) continue;
        const Vec3 normal = p.normalized();
        const double here = std::abs(speed_of(normal));
        for (int n = 0; n < 6; ++n) {
            const Vec3 along = (n % 2 == 0 ? kTilt : -kTilt) * Vec3::Unit(n / 2);
            const double beside = std::abs(speed_of((normal + along).normalized()));
            if (std::abs(beside - here) > kSteep * kTilt * std::min(beside, here)) return true;
        }
    }
    return false;
}

/// H of a crystal from one-sided first differences: a monotone scheme, which finds the slow faces.
/// Lax-Friedrichs beside slow faces and where phi is a plane. It rounds edges over a number of cells that
/// grows with the fastest wave of any face; edges of other faces therefore take Godunov's flux.
template <class SpeedOf>
float crystal(const Vec3& minus, const Vec3& plus, const Vec3& bounds, SpeedOf&& speed_of) {
    constexpr double kPlane = 0.02;
    if ((plus - minus).cwiseAbs().maxCoeff() <= kPlane || beside_slow_face(minus, plus, speed_of))
        return lax_friedrichs(minus, plus, bounds, speed_of);
    return godunov(minus, plus, speed_of);
}

/// Lax-Friedrichs flux of a row with a BeamSpeed: H(p) = facing max(0, p . d) + always |p|; its slopes by
/// central differences in closed form.
inline Row beam_row(const std::array<OneSided, 3>& d, float inv_dx, const Vec3& beam, const Row& facing,
                    const Row& always) {
    std::array<float, 3> towards, steep;
    for (std::size_t a = 0; a < 3; ++a) {
        towards[a] = static_cast<float>(beam[static_cast<int>(a)]);
        // Steepness of the kink at p . d = 0 in a central difference.
        steep[a] = towards[a] != 0.0f ? 0.5f / (static_cast<float>(kShift) * std::abs(towards[a])) : 0.0f;
    }
    using Slopes = std::array<Row, 3>;
    // Raises slopes to those at a place between the differences, 0 to 1 along each axis. \returns H there.
    const auto point = [&](float x, float y, float z, Slopes& largest) __attribute__((always_inline)) {
        const std::array<float, 3> at{x, y, z};
        Row value;
        for (std::size_t n = 0; n < kLanes; ++n) {
            float p[3], squares = 0.0f, facing_part = 0.0f;
            for (std::size_t a = 0; a < 3; ++a) {
                p[a] = ((1.0f - at[a]) * d[a].minus[n] + at[a] * d[a].plus[n]) * inv_dx;
                squares += p[a] * p[a];
                facing_part += p[a] * towards[a];
            }
            const float inverse = 1.0f / std::max(std::sqrt(squares), static_cast<float>(kLeastGradient));
            for (std::size_t a = 0; a < 3; ++a) {
                const float share = 0.5f + facing_part * inverse * steep[a];
                const float slope = facing[n] * towards[a] * std::min(std::max(share, 0.0f), 1.0f) +
                                    always[n] * p[a] * inverse;
                largest[a][n] = std::max(largest[a][n], std::abs(slope));
            }
            value[n] = facing[n] * std::max(facing_part, 0.0f) + always[n] * std::sqrt(squares);
        }
        return value;
    };
    Slopes middle{}, dissipation{};
    Row h = point(0.5f, 0.5f, 0.5f, middle);
    // The mean over all four diagonals between the differences: a mirrored wafer swaps the diagonals.
    for (const auto& [y, z] : {std::pair(0.0f, 0.0f), {1.0f, 0.0f}, {0.0f, 1.0f}, {1.0f, 1.0f}}) {
        Slopes largest = middle;
        point(0.0f, y, z, largest);
        point(1.0f, 1.0f - y, 1.0f - z, largest);
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t n = 0; n < kLanes; ++n) dissipation[a][n] += 0.25f * largest[a][n];
    }
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t n = 0; n < kLanes; ++n)
            h[n] -= 0.5f * dissipation[a][n] * (d[a].plus[n] - d[a].minus[n]) * inv_dx;
    // H keeps the sign as in lax_friedrichs: growth by dissipation alone where all etches would count as
    // growth of the uppermost layer.
    for (std::size_t n = 0; n < kLanes; ++n) {
        const float low = std::min(facing[n], always[n]), high = std::max(facing[n], always[n]);
        h[n] = high <= 0.0f ? std::min(h[n], 0.0f) : h[n];
        h[n] = low >= 0.0f ? std::max(h[n], 0.0f) : h[n];
    }
    return h;
}

/// Subcell resolution (Harten, J. Comput. Phys. 83 (1989) 148): where phi has a kink in the upwind cell of a
/// beam, replaces the upwind difference by the mean of what reaches the node within the time step. A floor's
/// distance ends beside a wall, a top's at its rim; a difference across that end would hold the floor back,
/// or move the wall below the rim. Only where the axis and the normal of one of the two fronts make 37
/// degrees or less.
/// \param courant  facing times the time step over dx, by node.
template <int R>
void resolve_kinks(const float* v, float inv_dx, const Vec3& beam, const Row& courant,
                   std::array<OneSided, 3>& d) {
    constexpr float kFacing = 0.8f;
    const float kink_least = static_cast<float>(kKink) / inv_dx, most = 1.0f / inv_dx;  // phi is a distance
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t n = 0; n < kLanes; ++n) {
            const float shift = courant[n] * static_cast<float>(beam[static_cast<int>(a)]);  // in cells
            if (shift == 0.0f) continue;
            const bool above = shift < 0.0f;
            const std::ptrdiff_t from = above ? Block<R>::kStride[a] : -Block<R>::kStride[a];
            const float* node = v + n;
            const float own = node[0] - node[-from], across = node[from] - node[0],
                        beyond = node[2 * from] - node[from];
            if (!((own - across) * (across - beyond) > 0.0f) || std::abs(own - beyond) <= kink_least ||
                std::max(std::abs(own), std::abs(beyond)) <= kFacing * most)
                continue;
            const float kink = (across - beyond) / (own - beyond), way = std::abs(shift);  // in cells
            const float mean = way <= kink ? own : (own * kink + beyond * (way - kink)) / way,
                        arrives = std::clamp(mean, -most, most);
            (above ? d[a].plus : d[a].minus)[n] = above ? arrives : -arrives;
        }
    }
}

/// H of a row's nodes where no V depends on the normal.
template <int R>
void constant_row(const float* v, const std::int32_t* entry, const SampleSpeeds& in, Row& h) {
    Row speed;
    bool any = false;
    for (std::size_t n = 0; n < kLanes; ++n) {
        const std::int32_t sample = SampleIndex::sample(entry[n]);
        const float of_sample = in.first[static_cast<std::size_t>(std::max(sample, 0))];
        speed[n] = sample < 0 ? 0.0f : of_sample;
        any |= speed[n] != 0.0f;
    }
    h.fill(0.0f);
    if (!any) return;
    const auto dx = static_cast<float>(in.stack.domain.spacing), inv_dx = 1.0f / dx;
    Row growing, etching;
    std::array<OneSided, 3> d;
    differences<R>(v, Block<R>::kStride, dx, d, growing, etching);
    for (std::size_t n = 0; n < kLanes; ++n)
        h[n] = speed[n] * inv_dx * std::sqrt(speed[n] > 0.0f ? growing[n] : etching[n]);
}

/// H of the nodes of a leaf's row (x, y), by their entries of a SampleIndex; 0 for nodes without a sample.
template <int R>
void hamiltonian_row(const Block<R>& block, int x, int y, const std::int32_t* entry, const SampleSpeeds& in,
                     Row& h) {
    const float* v = &block.value[static_cast<std::size_t>(Block<R>::at(x, y, 0))];
    if (in.all_constant) {
        constant_row<R>(v, entry, in, h);
        return;
    }
    using Way = SampleSpeeds::Way;
    Row first{}, second{};
    bool constant = false, beam = false, general = false;
    std::array<Way, kLanes> ways;
    std::array<std::int32_t, kLanes> sample;
    for (std::size_t n = 0; n < kLanes; ++n) {
        sample[n] = SampleIndex::sample(entry[n]);
        ways[n] = sample[n] < 0 ? Way::still : in.way[static_cast<std::size_t>(sample[n])];
        if (ways[n] == Way::still) continue;
        constant |= ways[n] == Way::constant || ways[n] == Way::as_distance, beam |= ways[n] == Way::beam,
            general |= ways[n] == Way::general;
        if (ways[n] != Way::general) first[n] = in.first[static_cast<std::size_t>(sample[n])];
        if (ways[n] == Way::beam) second[n] = in.second[static_cast<std::size_t>(sample[n])];
    }
    h.fill(0.0f);
    if (!constant && !beam && !general) return;
    const auto dx = static_cast<float>(in.stack.domain.spacing), inv_dx = 1.0f / dx;
    Row growing, etching;
    std::array<OneSided, 3> d;
    differences<R>(v, Block<R>::kStride, dx, d, growing, etching);
    if (beam) {
        std::array<OneSided, 3> resolved = d;
        if constexpr (R > 1) {
            Row courant;
            for (std::size_t n = 0; n < kLanes; ++n)
                courant[n] =
                    ways[n] == Way::beam ? first[n] * static_cast<float>(in.duration) * inv_dx : 0.0f;
            resolve_kinks<R>(v, inv_dx, in.motion.law.beam, courant, resolved);
        }
        h = beam_row(resolved, inv_dx, in.motion.law.beam, first, second);
    }
    if (constant) {
        Row upwind;
        for (std::size_t n = 0; n < kLanes; ++n)
            upwind[n] = first[n] * inv_dx * std::sqrt(first[n] > 0.0f ? growing[n] : etching[n]);
        for (std::size_t n = 0; n < kLanes; ++n) {
            h[n] = ways[n] == Way::constant ? upwind[n] : h[n];
            h[n] = ways[n] == Way::as_distance ? first[n] : h[n];
        }
    }
    for (std::size_t n = 0; general && n < kLanes; ++n) {
        if (ways[n] != Way::general) continue;
        const std::size_t index = in.evaluated(static_cast<std::size_t>(sample[n]));
        const Vec3 minus(d[0].minus[n] * inv_dx, d[1].minus[n] * inv_dx, d[2].minus[n] * inv_dx);
        const Vec3 plus(d[0].plus[n] * inv_dx, d[1].plus[n] * inv_dx, d[2].plus[n] * inv_dx);
        const auto speed_of = [&](const Vec3& normal) {
            return speed_over(in.stack, in.motion, index, normal, in.duration);
        };
        if (in.scheme == Scheme::lax_friedrichs) {
            const auto& bounds = in.motion.law.dissipation;
            if (bounds.empty() && std::abs(v[n]) < kNearFront * dx &&
                opened_edge<R>(v + n, inv_dx, speed_of, h[n]))
                continue;
            if (!in.slope.empty() &&
                expanded(minus, plus, in.motion.law.normal[index].template cast<double>(),
                         static_cast<double>(in.first[index]), in.slope[index].template cast<double>(), h[n]))
                continue;
            h[n] = bounds.empty() ? godunov(minus, plus, speed_of)
                                  : crystal(minus, plus,
                                            bounds[exposed(in.stack, in.motion.extension, index)], speed_of);
            // H keeps the sign as in beam_row; layers below do not grow either, see speed_over.
            if (in.motion.law.beam_speed) {
                const BeamSpeed of =
                    in.motion.law.beam_speed(index, exposed(in.stack, in.motion.extension, index));
                if (of.facing <= 0.0 && of.always <= 0.0) h[n] = std::min(h[n], 0.0f);
            }
            continue;
        }
        const Vec3 gradient = minus + plus;
        const double length = gradient.norm();
        const float speed = length > 0.0 ? static_cast<float>(speed_of(Vec3(gradient / length))) : 0.0f;
        h[n] = speed * inv_dx * std::sqrt(speed > 0.0f ? growing[n] : etching[n]);
    }
}

}  // namespace sidewall::levelset
