#include "flux/tracer/packets.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace sidewall::flux {
namespace {

static_assert(kLanes == surface::RayPacket::kRays);

constexpr float kFar = std::numeric_limits<float>::infinity();

// The box of a Geometry in single precision, for the inner loops.
struct Bounds {
    float min_x, min_y, max_x, max_y, top, bottom, overlap;
    bool reflect_x, reflect_y, open_x, open_y;
    explicit Bounds(const Geometry& geometry)
        : min_x(static_cast<float>(geometry.box.min[0])),
          min_y(static_cast<float>(geometry.box.min[1])),
          max_x(static_cast<float>(geometry.box.max[0])),
          max_y(static_cast<float>(geometry.box.max[1])),
          top(static_cast<float>(geometry.top)),
          bottom(static_cast<float>(geometry.bottom)),
          overlap(static_cast<float>(kOverlap * geometry.skin)),
          reflect_x(geometry.box.boundary[0] == Boundary::reflective),
          reflect_y(geometry.box.boundary[1] == Boundary::reflective),
          open_x(geometry.box.boundary[0] == Boundary::open),
          open_y(geometry.box.boundary[1] == Boundary::open) {}
};

// Distances along eight rays to the sides in x and in y, and to the top or bottom.
struct alignas(32) Reach {
    float side_x[kLanes], side_y[kLanes], exit[kLanes];
};

// Distance to the plane ahead, never negative; infinite for a ray parallel to it.
inline float distance_to(float low, float high, float position, float direction) {
    const float plane = direction > 0.0f ? high : low;
    const float distance = std::max(0.0f, (plane - position) / direction);
    return direction == 0.0f ? kFar : distance;
}

inline void reach_of(const Bounds& b, const float* x, const float* y, const float* z, const float* dx,
                     const float* dy, const float* dz, Reach& reach) {
    for (std::size_t i = 0; i < kLanes; ++i) {
        reach.side_x[i] = distance_to(b.min_x, b.max_x, x[i], dx[i]);
        reach.side_y[i] = distance_to(b.min_y, b.max_y, y[i], dy[i]);
        reach.exit[i] = distance_to(b.bottom, b.top, z[i], dz[i]);
    }
}

// Particles that crossed a side of the box and continue; `row` is their row in the block.
struct alignas(64) Crossing : FlightStarts {
    std::size_t count = 0;
    Column<float> travelled;  // length flown before this segment; set only if free paths are limited
    Column<std::uint32_t> row;
};

// Repeats the flight of one particle by fly(), from its start, which is still in its row.
void fly_alone(const Geometry& geometry, Rays& rays, std::size_t row, double free_path,
               FlightCounts& counts) {
    Vec3 start = rays.point(row);
    for (int axis = 0; axis < 2; ++axis)
        start[axis] = std::clamp(start[axis], geometry.box.min[axis], geometry.box.max[axis]);
    const Vec3 direction = rays.direction(row).normalized();
    const Flight flight = fly(geometry, {start, direction, rays.from[row]}, free_path);
    counts.segments += flight.segments;
    if (flight.end != FlightEnd::hit) {
        rays.triangle[row] = flight.end == FlightEnd::escaped    ? surface::kNoTriangle
                             : flight.end == FlightEnd::collided ? kCollided
                                                                 : kLeaked;
        return;
    }
    counts.rescued += flight.rescued;
    rays.set(row, hit_point(geometry, flight), flight.direction);
    rays.triangle[row] = flight.triangle;
    rays.u[row] = static_cast<float>(flight.u);
    rays.v[row] = static_cast<float>(flight.v);
    rays.distance[row] = 0.0f;
    set_vector(outward_normal(geometry, flight.triangle), rays.nx, rays.ny, rays.nz, row);
}

// Moves lane i of a packet to the side it meets and through it. \returns false if that side is open.
inline bool cross(const Bounds& b, const Reach& reach, std::size_t i, float& x, float& y, float& z, float& dx,
                  float& dy, float dz) {
    const bool first = reach.side_x[i] <= reach.side_y[i];
    if (first ? b.open_x : b.open_y) return false;
    const float distance = first ? reach.side_x[i] : reach.side_y[i];
    x = std::clamp(x + distance * dx, b.min_x, b.max_x);
    y = std::clamp(y + distance * dy, b.min_y, b.max_y);
    z += distance * dz;
    if (first) {
        x = (dx > 0.0f) == b.reflect_x ? b.max_x : b.min_x;
        if (b.reflect_x) dx = -dx;
    } else {
        y = (dy > 0.0f) == b.reflect_y ? b.max_y : b.min_y;
        if (b.reflect_y) dy = -dy;
    }
    return true;
}

// The flights of a block in packets of eight. \tparam kWithin  collisions limit free paths; false costs
// nothing.
template <bool kWithin>
class PacketFlight {
  public:
    PacketFlight(const Geometry& geometry, Rays& rays, const Column<float>* free_path, FlightCounts& counts)
        : geometry_(geometry), rays_(rays), free_path_(free_path), counts_(counts), b_(geometry) {}

    void fly() {
        static thread_local Crossing crossing;  // too large for a stack frame
        crossing.count = 0;
        for (std::size_t first = 0; first < rays_.count; first += kLanes) start_packet(first, crossing);
        // Particles that cross more than 1000 sides may be caught by rounding: fly() decides.
        for (int round = 0; crossing.count > 0; ++round) {
            if (round == 1000) {
                for (std::size_t i = 0; i < crossing.count; ++i) alone(crossing.row[i]);
                return;
            }
            const std::size_t count = crossing.count;
            crossing.count = 0;
            for (std::size_t first = 0; first < count; first += kLanes)
                continue_packet(first, count, crossing);
        }
    }

  private:
    void alone(std::size_t row) {
        double free_path = kInfinity;
        if constexpr (kWithin) free_path = static_cast<double>((*free_path_)[row]);
        fly_alone(geometry_, rays_, row, free_path, counts_);
    }

    // Whether lane i's free path ends before the particle hits the surface, meets a side or leaves.
    bool collides(std::size_t i, std::size_t row, float travelled, float back_up) const {
        const float way = packet_.triangle[i] == surface::kNoTriangle
                              ? std::min(std::min(reach_.side_x[i], reach_.side_y[i]), reach_.exit[i])
                              : packet_.t_max[i] - back_up;
        return travelled + way > (*free_path_)[row];
    }

    // Traces the first `lanes` rays, from `back_up` before the given positions.
    void intersect(const float* x, const float* y, const float* z, const float* dx, const float* dy,
                   const float* dz, std::size_t lanes, float back_up) {
        reach_of(b_, x, y, z, dx, dy, dz, reach_);
        for (std::size_t i = 0; i < kLanes; ++i) {
            valid_[i] = i < lanes ? -1 : 0;
            packet_.origin_x[i] = x[i] - back_up * dx[i];
            packet_.origin_y[i] = y[i] - back_up * dy[i];
            packet_.origin_z[i] = z[i] - back_up * dz[i];
            packet_.direction_x[i] = dx[i];
            packet_.direction_y[i] = dy[i];
            packet_.direction_z[i] = dz[i];
            packet_.t_min[i] = 0.0f;
            packet_.t_max[i] =
                std::min(std::min(reach_.side_x[i], reach_.side_y[i]), reach_.exit[i]) + back_up + b_.overlap;
        }
        counts_.segments += lanes;
        geometry_.scene.closest_hits(valid_, packet_);
        // Embree's normal is as long as twice the area, so compare squares.
        constexpr auto kGrazingSquared = static_cast<float>(kGrazing * kGrazing);
        for (std::size_t i = 0; i < kLanes; ++i) {
            const float nx = packet_.normal_x[i], ny = packet_.normal_y[i], nz = packet_.normal_z[i];
            const float d = nx * dx[i] + ny * dy[i] + nz * dz[i];
            behind_[i] = (d > 0.0f) & (d * d > kGrazingSquared * (nx * nx + ny * ny + nz * nz)) ? -1 : 0;
        }
    }

    // What lane i's ray does that hit no triangle: meets a side; escapes through the top, or through the
    // bottom if a side is open; or is below the surface, which fly() must resolve.
    enum class NoHit { side, escape, unclear };
    NoHit no_hit(std::size_t i, float dz) const {
        if (std::min(reach_.side_x[i], reach_.side_y[i]) < reach_.exit[i]) return NoHit::side;
        return dz > 0.0f || b_.open_x || b_.open_y ? NoHit::escape : NoHit::unclear;
    }

    void start_packet(std::size_t first, Crossing& crossing) {
        Rays& r = rays_;
        const std::size_t lanes = std::min(kLanes, r.count - first);
        intersect(&r.x[first], &r.y[first], &r.z[first], &r.dx[first], &r.dy[first], &r.dz[first], lanes,
                  0.0f);
        // Nearly all lanes are clear: they hit a front face or escape. Find the others in loops without
        // branches, which vectorise.
        alignas(32) int unclear[kLanes];
        int any = 0;
        const int open = b_.open_x || b_.open_y ? -1 : 0;
        const float* const dz = &r.dz[first];
        const std::uint32_t* const from = &r.from[first];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const std::uint32_t triangle = packet_.triangle[i];
            const int ends = std::min(reach_.side_x[i], reach_.side_y[i]) >= reach_.exit[i] ? -1 : 0;
            const int out = ends & ((dz[i] > 0.0f ? -1 : 0) | open);
            const int own = triangle == from[i] ? -1 : 0, missed = triangle == surface::kNoTriangle ? -1 : 0;
            unclear[i] = valid_[i] & ((missed & ~out) | (~missed & (behind_[i] | own)));
        }
        store_hits(first);
        if constexpr (kWithin)
            for (std::size_t i = 0; i < lanes; ++i)
                if (collides(i, first + i, 0.0f, 0.0f)) {
                    r.triangle[first + i] = kCollided;
                    unclear[i] = 0;
                }
        for (std::size_t i = 0; i < kLanes; ++i) any |= unclear[i];
        if (any == 0) return;
        for (std::size_t i = 0; i < lanes; ++i) {
            if (unclear[i] == 0) continue;
            const std::size_t row = first + i;
            if (r.triangle[row] != surface::kNoTriangle || no_hit(i, r.dz[row]) == NoHit::unclear) {
                alone(row);
                continue;
            }
            float x = r.x[row], y = r.y[row], z = r.z[row], dx = r.dx[row], dy = r.dy[row];  // side hit
            if (!cross(b_, reach_, i, x, y, z, dx, dy, r.dz[row])) continue;
            push(crossing, row, x, y, z, dx, dy, r.dz[row], std::min(reach_.side_x[i], reach_.side_y[i]));
        }
    }

    void continue_packet(std::size_t first, std::size_t count, Crossing& c) {
        Rays& r = rays_;
        const std::size_t lanes = std::min(kLanes, count - first);
        intersect(&c.x[first], &c.y[first], &c.z[first], &c.dx[first], &c.dy[first], &c.dz[first], lanes,
                  b_.overlap);
        for (std::size_t i = 0; i < lanes; ++i) {
            const std::size_t at = first + i;
            const std::uint32_t row = c.row[at], triangle = packet_.triangle[i];
            float x = c.x[at], y = c.y[at], z = c.z[at], dx = c.dx[at], dy = c.dy[at];
            const float dz = c.dz[at];
            if constexpr (kWithin)
                if (collides(i, row, c.travelled[at], b_.overlap)) {
                    r.triangle[row] = kCollided;
                    continue;
                }
            if (triangle != surface::kNoTriangle) {  // surface hit
                if (behind_[i]) {
                    alone(row);
                    continue;
                }
                r.x[row] = packet_.origin_x[i];
                r.y[row] = packet_.origin_y[i];
                r.z[row] = packet_.origin_z[i];
                r.dx[row] = dx;
                r.dy[row] = dy;
                store_hit(row, i);
                continue;
            }
            const NoHit next = no_hit(i, dz);
            const float travelled = kWithin ? c.travelled[at] : 0.0f;
            if (next == NoHit::unclear)
                alone(row);
            else if (next == NoHit::escape || !cross(b_, reach_, i, x, y, z, dx, dy, dz))
                r.triangle[row] = surface::kNoTriangle;
            else
                push(c, row, x, y, z, dx, dy, dz, travelled + std::min(reach_.side_x[i], reach_.side_y[i]));
        }
    }

    // Calls store(column, lanes) for each quantity of a hit.
    template <class Store>
    void each_of_hit(const Store& store) {
        store(rays_.triangle, packet_.triangle);
        store(rays_.u, packet_.u);
        store(rays_.v, packet_.v);
        store(rays_.nx, packet_.normal_x);
        store(rays_.ny, packet_.normal_y);
        store(rays_.nz, packet_.normal_z);
        store(rays_.distance, packet_.t_max);
    }
    void store_hit(std::size_t row, std::size_t lane) {
        each_of_hit([=](auto& column, const auto& lanes) { column[row] = lanes[lane]; });
    }
    // store_hit() for all lanes, lane i in row first + i, column by column.
    void store_hits(std::size_t first) {
        each_of_hit(
            [=](auto& column, const auto& lanes) { std::memcpy(&column[first], &lanes[0], sizeof lanes); });
    }

    static void push(Crossing& c, std::size_t row, float x, float y, float z, float dx, float dy, float dz,
                     float travelled) {
        const std::size_t at = c.count++;
        c.x[at] = x;
        c.y[at] = y;
        c.z[at] = z;
        c.dx[at] = dx;
        c.dy[at] = dy;
        c.dz[at] = dz;
        if constexpr (kWithin) c.travelled[at] = travelled;
        c.row[at] = static_cast<std::uint32_t>(row);
    }

    const Geometry& geometry_;
    Rays& rays_;
    const Column<float>* free_path_;
    FlightCounts& counts_;
    const Bounds b_;
    alignas(32) int valid_[kLanes];
    alignas(32) int behind_[kLanes];  // lanes that hit the back of a triangle
    surface::RayPacket packet_;
    Reach reach_;
};

// Directions before turn_into_plane.
struct DirectionInProfile {
    Column<float> along;  // y component
    Column<float> share;  // length of the x and z components
};

// Projects flights over a 2-D profile, which is equal at all y, to the plane of x and z.
void turn_into_plane(const Geometry& geometry, Rays& rays, DirectionInProfile& kept) {
    // Below this the direction is along y, and its projection only rounding: fly straight up instead.
    constexpr float kLeastShare = 1e-6f;
    const auto overlap = static_cast<float>(kOverlap * geometry.skin);
    const float low = static_cast<float>(geometry.box.min[1]) + overlap,
                high = static_cast<float>(geometry.box.max[1]) - overlap;
    for (std::size_t i = 0; i < rays.count; ++i) {
        const float share = std::sqrt(rays.dx[i] * rays.dx[i] + rays.dz[i] * rays.dz[i]);
        kept.along[i] = rays.dy[i];
        kept.share[i] = std::max(share, kLeastShare);
        const bool level = share < kLeastShare;
        rays.dx[i] = level ? 0.0f : rays.dx[i] / share;
        rays.dz[i] = level ? 1.0f : rays.dz[i] / share;
        rays.dy[i] = 0.0f;
        // Keep y off the sides, where a ray might slip past the triangles' edges.
        rays.y[i] = std::min(std::max(rays.y[i], low), high);
    }
}

void turn_back(Rays& rays, const DirectionInProfile& kept) {
    for (std::size_t i = 0; i < rays.count; ++i) {
        rays.dx[i] *= kept.share[i];
        rays.dz[i] *= kept.share[i];
        rays.dy[i] = kept.along[i];
        rays.distance[i] /= kept.share[i];
        // Shift the start so that the end, start + distance * direction, has the y of the flight.
        rays.y[i] -= rays.distance[i] * rays.dy[i];
    }
}

// Flights past a surface of revolution, one by one. Hits are booked on the first triangle of the segment, in
// the plane y = 0.
void fly_all_round(const Geometry& geometry, Rays& rays, const Column<float>* free_path,
                   FlightCounts& counts) {
    for (std::size_t row = 0; row < rays.count; ++row) {
        const double path = free_path != nullptr ? static_cast<double>((*free_path)[row]) : kInfinity;
        const RoundFlight flight =
            fly_round(geometry, rays.point(row), rays.direction(row).normalized(), path);
        counts.segments += flight.flights;
        counts.rescued += flight.rescued ? 1 : 0;
        rays.distance[row] = 0.0f;
        rays.set(row, flight.point, flight.direction);
        if (flight.end != FlightEnd::hit) {
            rays.triangle[row] = flight.end == FlightEnd::escaped    ? surface::kNoTriangle
                                 : flight.end == FlightEnd::collided ? kCollided
                                                                     : kLeaked;
            continue;
        }
        rays.triangle[row] = 2 * flight.segment;
        rays.u[row] = rays.v[row] = 0.5f * static_cast<float>(flight.along);
        set_vector(geometry.revolution->normal(flight.segment), rays.nx, rays.ny, rays.nz, row);
    }
}

template <bool kWithin>
void fly_packets(const Geometry& geometry, Rays& rays, const Column<float>* free_path, FlightCounts& counts) {
    if (geometry.revolution) {
        fly_all_round(geometry, rays, free_path, counts);
        return;
    }
    if (!geometry.straight) {
        PacketFlight<kWithin>(geometry, rays, free_path, counts).fly();
        return;
    }
    static thread_local DirectionInProfile kept;  // too large for a stack frame
    static thread_local Column<float> in_plane;
    turn_into_plane(geometry, rays, kept);
    if constexpr (kWithin)
        for (std::size_t i = 0; i < rays.count; ++i) in_plane[i] = (*free_path)[i] * kept.share[i];
    PacketFlight<kWithin>(geometry, rays, &in_plane, counts).fly();
    turn_back(rays, kept);
}

}  // namespace

void fly_block(const Geometry& geometry, Rays& rays, FlightCounts& counts) {
    fly_packets<false>(geometry, rays, nullptr, counts);
}

void fly_block_within(const Geometry& geometry, Rays& rays, const Column<float>& free_path,
                      FlightCounts& counts) {
    fly_packets<true>(geometry, rays, &free_path, counts);
}

}  // namespace sidewall::flux
