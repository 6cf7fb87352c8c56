// The life of a ray of an exchange, and the function of each stage:
//
//     start    at a point of the surface, stratified along a space-filling curve   draw_rays
//     aim      by Lambert's law, or at a point of the surface or source plane      draw_rays
//              (source rays instead start at the source, as the tracer's do)       emit
//     fly      to the first hit                                                    fly_block
//     join     the two ends, with a weight of one over the sum of the densities    join
//              with which all kinds of rays sample such a pair
#include "flux/radiosity/gatherer.hpp"

#include <algorithm>
#include <cmath>

#include "flux/sampling.hpp"
#include "flux/source.hpp"

namespace sidewall::flux {
namespace {

constexpr std::uint32_t kScrambles = 0xffffffffu;  // bounce of the scrambling words: no ray has it

// A path unfolded across the sides that it crossed: its length, its end, and the image in which that lies.
struct Path {
    double length = 0.0;
    int image = kNoImage;
    Vec3 end;
};

Path straightened(const RayDensities& densities, const Vec3& start, const Vec3& direction, const Vec3& hit,
                  double skin) {
    const Vec3 way = hit - start;
    const double length = way.norm();
    if (densities.round()) {  // the hit has been turned into the plane y = 0
        if (!(std::abs(direction.z()) >= kLevel)) return {length, kNoImage, hit};
        const double travelled = way.z() / direction.z();
        const Vec3 end = start + travelled * direction;
        return {travelled, densities.image_of(end), end};
    }
    if (way.cross(direction).squaredNorm() <= 1e-8 * length * length + 4.0 * skin * skin)
        return {length, kImageRow * kImages + kImages, hit};
    if (!(std::abs(direction.z()) >= kLevel)) return {length, kNoImage, hit};
    const double travelled = way.z() / direction.z();
    const Vec3 end = start + travelled * direction;
    return {travelled, densities.image_of(end), end};
}

// Barycentric weights of the facet's second and third corners at a point near the facet.
// \param round  whether the facet is the first triangle of a segment and the point lies in the plane y = 0.
void barycentric(const Facet& facet, const Vec3& point, bool round, float& u, float& v) {
    if (round) {
        const Vec3 along(facet.edge1.x(), 0.0, facet.edge1.z()),
            from(facet.corner.x(), 0.0, facet.corner.z());
        u = v =
            0.5f * static_cast<float>(std::clamp((point - from).dot(along) / along.squaredNorm(), 0.0, 1.0));
        return;
    }
    const Vec3 way = point - facet.corner;
    const double aa = facet.edge1.squaredNorm(), bb = facet.edge2.squaredNorm(),
                 ab = facet.edge1.dot(facet.edge2), a = way.dot(facet.edge1), b = way.dot(facet.edge2);
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 0.0)) return;
    u = static_cast<float>(std::clamp((a * bb - b * ab) / determinant, 0.0, 1.0));
    v = static_cast<float>(std::clamp((b * aa - a * ab) / determinant, 0.0, 1.0 - static_cast<double>(u)));
}

struct Block {
    Rays rays;
    FlightStarts begun;            // the rays at their start
    Column<std::uint32_t> target;  // triangle that a connection aims at
    Column<int> image;
};

// A ray after its flight. If `aimed`, it has a target: a triangle or (kNoTriangle) the source plane.
struct ConnectingRay {
    Vec3 start, direction, arriving, hit;
    std::uint32_t from, triangle, target;
    float u, v;
    bool aimed;
    int image;
};

// Number of the job's stream of random numbers, a key.
std::uint32_t number_of(const Job& job, std::uint32_t gather) {
    return (gather * static_cast<std::uint32_t>(kSampleGroups) + job.group) * 64 +
           static_cast<std::uint32_t>(job.kind) * 16 + job.exponent;
}

// Draws rays from the surface, without connections of which an end faces away from the other.
void draw_rays(const Exchange::State& s, RandomKey key, std::uint32_t number, const Job& job, Block& block) {
    const RayDensities& densities = *s.densities;
    const LateralBox& box = s.geometry.box;
    Stream scramble(key, {.batch = number, .bounce = kScrambles});
    const std::uint32_t words[4] = {scramble.next(), scramble.next(), scramble.next(), scramble.next()};
    const std::uint32_t all =
        job.kind == RayKind::cosine ? densities.counts().cosine : densities.counts().connect;
    Rays& r = block.rays;
    r.count = 0;
    for (std::uint32_t i = job.first; i < job.first + job.count; ++i) {
        const Draws random = draw(key, std::uint64_t{number} << 32 | i, 0);
        const Distribution::Pick start = densities.starts().pick((i + random.uniform(0)) / all);
        const std::uint32_t triangle = densities.start_triangle(start.item);
        const Facet& facet = densities.facets()[triangle];
        const double root = std::sqrt(start.rest), part = random.uniform(1);
        Vec3 position = facet.corner + root * (1.0 - part) * facet.edge1 + root * part * facet.edge2 +
                        s.geometry.skin * facet.normal;
        for (int axis = 0; axis < 2; ++axis)
            position[axis] = std::clamp(position[axis], box.min[axis], box.max[axis]);
        if (densities.round()) position.y() = 0.0;
        const double first = unit_double(owen_scrambled(reversed_bits(i), words[0], words[1]));
        const double second = unit_double(owen_scrambled(sobol_second(i), words[2], words[3]));
        const std::size_t row = r.count;
        Vec3 direction;
        if (job.kind == RayKind::cosine) {
            direction = sample_lambertian(facet.normal, first, second);
        } else {
            const RayDensities::Target target = densities.target(first, second, random.uniform(2));
            const Vec3 way = target.point - position;
            if (!(way.dot(facet.normal) > 0.0 && way.dot(target.normal) < 0.0)) continue;
            direction = way.normalized();
            block.target[row] = target.triangle;
            block.image[row] = target.image;
        }
        r.set(row, position, direction);
        r.from[row] = densities.round() ? triangle & ~1u : triangle;
        ++r.count;
    }
}

// Adds the exit of a ray through the source plane, a side or the rim; of an aimed ray only if it reaches the
// source plane in the image at which it aimed.
void join_exit(const Exchange::State& s, const ConnectingRay& ray, BlockSamples& found) {
    if (ray.aimed && ray.target != surface::kNoTriangle) return;
    const RayDensities& densities = *s.densities;
    const Facet& facet = densities.facets()[ray.from];
    ExitSample exit{ray.from, 0.0f, 0.0f, 0.0f, 0.0f};
    barycentric(facet, ray.start, densities.round(), exit.au, exit.av);
    const double rise = ray.direction.z();
    const auto [out, travelled, end] = domain_exit(s.geometry, ray.start, ray.direction);
    double weight = 0.0;
    if (out) {
        const int image = rise >= kLevel ? densities.image_of(end) : kNoImage;
        if (ray.aimed && image != ray.image) return;
        const double form = densities.form(travelled, ray.direction.dot(facet.normal) * rise);
        weight = densities.exit_weight(ray.from, end, image, form, rise);
    } else {
        if (ray.aimed) return;
        weight = densities.loss_weight(ray.from);
    }
    exit.weight = static_cast<float>(weight);
    exit.cosine = out ? static_cast<float>(rise) : 0.0f;
    found.exits.push_back(exit);
}

// Adds the exit of a ray from the source that hit the surface: the point that was hit sees the source.
void join_source(const Exchange::State& s, const ConnectingRay& ray, bool pilot, BlockSamples& found) {
    const RayDensities& densities = *s.densities;
    if (pilot) {
        found.lit.push_back(ray.triangle);
        found.openings.push_back(static_cast<std::uint32_t>(densities.cell_of(ray.start)));
    }
    const Path path = straightened(densities, ray.start, ray.direction, ray.hit, s.geometry.skin);
    const double cosine = -ray.direction.z();
    const double arrival = -ray.arriving.dot(densities.facets()[ray.triangle].normal);
    // Seen from the hit, the start lies in the opposite image, which has the same share (set_images).
    const double weight =
        densities.exit_weight(ray.triangle, ray.start, cosine >= kLevel ? path.image : kNoImage,
                              densities.form(path.length, cosine * arrival), cosine);
    found.exits.push_back(
        {ray.triangle, ray.u, ray.v, static_cast<float>(weight), static_cast<float>(cosine)});
}

// Adds the pair of a ray between two points of the surface; of an aimed one only if it hit its target.
void join_pair(const Exchange::State& s, const ConnectingRay& ray, bool pilot, BlockSamples& found) {
    const RayDensities& densities = *s.densities;
    if (ray.aimed && !densities.same_facet(ray.triangle, ray.target)) return;
    const Path path = straightened(densities, ray.start, ray.direction, ray.hit, s.geometry.skin);
    if (ray.aimed && path.image != ray.image) return;
    const Facet& facet = densities.facets()[ray.from];
    const double arrival = -ray.arriving.dot(densities.facets()[ray.triangle].normal);
    const double form = densities.form(path.length, ray.direction.dot(facet.normal) * arrival);
    PairSample pair{ray.from,
                    ray.triangle,
                    0.0f,
                    0.0f,
                    ray.u,
                    ray.v,
                    static_cast<float>(densities.pair_weight(ray.from, ray.triangle, path.image, form))};
    barycentric(facet, ray.start, densities.round(), pair.au, pair.av);
    found.pairs.push_back(pair);
    if (pilot && path.image != kNoImage) found.images[static_cast<std::size_t>(path.image)] += 1.0;
}

void join(const Exchange::State& s, const Job& job, const Block& block, std::size_t row, bool pilot,
          BlockSamples& found) {
    const Rays& r = block.rays;
    if (r.triangle[row] == kLeaked) {
        ++found.leaked;
        return;
    }
    ConnectingRay ray;
    ray.start = block.begun.point(row);
    ray.direction = block.begun.direction(row);
    ray.arriving = r.direction(row);
    ray.from = r.from[row];
    ray.triangle = r.triangle[row];
    ray.aimed = job.kind == RayKind::connect;
    ray.target = ray.aimed ? block.target[row] : surface::kNoTriangle;
    ray.image = ray.aimed ? block.image[row] : kNoImage;
    if (pilot && job.kind == RayKind::cosine) found.started.push_back(ray.from);
    if (ray.triangle == surface::kNoTriangle) {
        if (job.kind != RayKind::source && !s.sky) join_exit(s, ray, found);
        return;
    }
    ray.u = r.u[row];
    ray.v = r.v[row];
    ray.hit = r.point(row) + static_cast<double>(r.distance[row]) * ray.arriving;
    if (job.kind == RayKind::source)
        join_source(s, ray, pilot, found);
    else
        join_pair(s, ray, pilot, found);
}

}  // namespace

BlockSamples trace_job(const Exchange::State& s, RandomKey key, std::uint32_t gather, const Job& job,
                       bool pilot) {
    static thread_local Block block;  // too large for a stack frame
    Rays& r = block.rays;
    BlockSamples found;
    if (pilot) found.images.assign(std::size_t{kImageRow} * kImageRow, 0.0);
    const std::uint32_t number = number_of(job, gather);
    if (job.kind == RayKind::source) {
        Species species;
        species.source_exponent = s.densities->exponents()[job.exponent];
        const Batch batch = make_batch(key, number, s.densities->counts().source);
        emit(s.geometry, species, {}, key, batch, job.first, job.count, r);
    } else {
        draw_rays(s, key, number, job, block);
    }
    block.begun = r;
    fly_block(s.geometry, r, found.flights);
    found.pairs.reserve(r.count);
    for (std::size_t row = 0; row < r.count; ++row) join(s, job, block, row, pilot, found);
    return found;
}

}  // namespace sidewall::flux
