#include "app/pictures/render.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kOcclusionRays = 16;  // rays per sample; a pixel has four samples

/// A camera far away: its mild perspective lets parallel walls look parallel.
struct Camera {
    Vec3 position, right, up, forward;
    double tangent = std::tan(9.0 * kRadians);  ///< half the picture's height at distance 1
    double shift_x = 0.0, shift_y = 0.0;        ///< shift of the picture plane at distance 1

    /// Ray direction through a point of the picture; x and y in units of half the picture's height.
    Vec3 direction(double x, double y) const {
        return (forward + (x * tangent + shift_x) * right + (y * tangent + shift_y) * up).normalized();
    }
};

Vec3 to_viewer(const RenderOptions& options) {
    const double azimuth = options.azimuth_deg * kRadians, elevation = options.elevation_deg * kRadians;
    return {std::sin(azimuth) * std::cos(elevation), -std::cos(azimuth) * std::cos(elevation),
            std::sin(elevation)};
}

/// Places the camera so that the box fills the part of the picture left of the legend.
Camera frame(const Box3& box, const RenderOptions& options, double legend_width) {
    const double azimuth = options.azimuth_deg * kRadians;
    Camera camera;
    camera.forward = -to_viewer(options);
    camera.right = Vec3(std::cos(azimuth), std::sin(azimuth), 0.0);
    camera.up = camera.right.cross(camera.forward);
    constexpr double kFill = 0.9;
    const double aspect = static_cast<double>(options.width) / options.height;
    const double half_width = kFill * camera.tangent * (aspect - legend_width),
                 half_height = kFill * camera.tangent;
    const Vec3 centre = 0.5 * (box.min + box.max);
    const double size = std::max(box.size().norm(), std::numeric_limits<double>::min());
    double distance = 4.0 * size;
    Vec3 target = centre;
    // Fixed-point iteration, as perspective makes distance implicit; errors shrink by about size / distance.
    for (int round = 0; round < 12; ++round) {
        camera.position = target - distance * camera.forward;
        double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3 p =
                Vec3(corner & 1 ? box.max.x() : box.min.x(), corner & 2 ? box.max.y() : box.min.y(),
                     corner & 4 ? box.max.z() : box.min.z()) -
                camera.position;
            const double depth = std::max(p.dot(camera.forward), 0.1 * size);
            const double at[2] = {p.dot(camera.right) / depth, p.dot(camera.up) / depth};
            for (int k = 0; k < 2; ++k) {
                low[k] = std::min(low[k], at[k]);
                high[k] = std::max(high[k], at[k]);
            }
        }
        target += 0.5 * distance * ((low[0] + high[0]) * camera.right + (low[1] + high[1]) * camera.up);
        const double fill =
            std::max((high[0] - low[0]) / (2.0 * half_width), (high[1] - low[1]) / (2.0 * half_height));
        distance = std::max(distance * fill, size);
    }
    camera.position = target - distance * camera.forward;
    camera.shift_x = camera.tangent * legend_width;
    return camera;
}

/// The part that is drawn: \p box, lowered below the open surface of a solid, without what the cut removes.
Box3 drawn_box(Box3 box, const RenderScene& scene, const RenderOptions& options) {
    const double lateral = std::max(box.size().x(), box.size().y());
    const bool closed = surface::analyse_topology(scene.surface()).closed();
    if (scene.solid() && !closed) {
        box.min.z() -= 0.12 * lateral;
        box.max.z() += 1e-3 * lateral;
    } else {
        const Vec3 margin = Vec3::Constant(1e-3 * box.size().norm());
        box.min -= margin;
        box.max += margin;
    }
    if (!options.cut) return box;
    int axis = -1;
    for (int k = 0; k < 3; ++k)
        if (options.cut->normal.cwiseAbs() == Vec3::Unit(k)) axis = k;
    if (axis < 0) throw RecipeError("--cut: must be x, y or z = a number, such as y=0");
    const double at = options.cut->offset * options.cut->normal[axis];
    if (!(at > box.min[axis] && at < box.max[axis]))
        throw RecipeError("--cut {}={}: misses the surface, which spans {} to {}", "xyz"[axis], at,
                          box.min[axis], box.max[axis]);
    (to_viewer(options)[axis] >= 0.0 ? box.max : box.min)[axis] = at;
    return box;
}

struct Span {
    double enter, leave;
    int axis;  ///< axis of the face entered
};

/// The part of a ray within a box; enter > leave if it misses.
Span clip(const Box3& box, const Vec3& origin, const Vec3& direction) {
    Span span{0.0, std::numeric_limits<double>::max(), -1};
    for (int k = 0; k < 3; ++k) {
        if (direction[k] == 0.0) {
            if (origin[k] < box.min[k] || origin[k] > box.max[k]) return {1.0, 0.0, -1};
            continue;
        }
        double near = (box.min[k] - origin[k]) / direction[k], far = (box.max[k] - origin[k]) / direction[k];
        if (near > far) std::swap(near, far);
        if (near > span.enter) span.enter = near, span.axis = k;
        span.leave = std::min(span.leave, far);
    }
    return span;
}

std::uint32_t mix(std::uint32_t x) {
    x = (x ^ x >> 16) * 0x7feb352du;
    x = (x ^ x >> 15) * 0x846ca68bu;
    return x ^ x >> 16;
}

struct Painter {
    const RenderScene& scene;
    const RenderOptions& options;
    Camera camera;
    Box3 box;
    double size;   ///< diagonal of the box
    double pixel;  ///< half a pixel's width at distance 1

    /// Ambient occlusion: cosine-weighted share of sky at a point; obstacles count within half the diagonal.
    double openness(const Vec3& point, const Vec3& normal, std::uint32_t key) const {
        const Vec3 side =
            (std::abs(normal.x()) < 0.7 ? Vec3::UnitX() : Vec3::UnitY()).cross(normal).normalized();
        const Vec3 other = normal.cross(side);
        const double turn = mix(key) * 0x1p-32, lift = mix(key ^ 0x9e3779b9u) * 0x1p-32;
        int open = 0;
        for (int i = 0; i < kOcclusionRays; ++i) {
            const double u = (i + lift) / kOcclusionRays;
            const double angle = 2.0 * std::numbers::pi * (i * (std::numbers::phi - 1.0) + turn);
            const Vec3 direction = std::sqrt(u) * (std::cos(angle) * side + std::sin(angle) * other) +
                                   std::sqrt(1.0 - u) * normal;
            // Only obstacles in the drawn box cast shade, so that light enters through the cut, too.
            const double reach = std::min(clip(box, point, direction).leave, 0.5 * size);
            open += !scene.rays().occluded(point, direction, 0.0, reach);
        }
        return static_cast<double>(open) / kOcclusionRays;
    }

    Colour lit(const Colour& colour, const Vec3& normal, double open) const {
        const Vec3 key = (-camera.forward - 0.55 * camera.right + 0.75 * camera.up).normalized();
        const double sky = (0.45 + 0.12 * normal.z()) * open;
        const double lamp = 0.42 * std::max(0.0, normal.dot(key)) * (0.35 + 0.65 * open);
        const double head = 0.16 * std::max(0.0, -normal.dot(camera.forward));
        return (sky + lamp + head) * colour;
    }

    Colour background(double y) const {
        const double t = 0.5 * (1.0 - y);
        return (1.0 - t) * colour_from_hex("#ffffff") + t * colour_from_hex("#e4e9f0");
    }

    double edge_cover(const surface::SurfaceHit& hit, double distance) const {
        const TriangleMesh& mesh = scene.surface();
        const Triangle& t = mesh.triangles[hit.triangle];
        const double twice_area = area_vector(mesh, hit.triangle).norm();
        const double weights[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
        double nearest = std::numeric_limits<double>::max();
        for (std::size_t k = 0; k < 3; ++k) {
            const double base = (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[(k + 2) % 3]]).norm();
            if (base > 0.0) nearest = std::min(nearest, std::max(0.0, weights[k]) * twice_area / base);
        }
        return std::clamp(1.6 - nearest / (pixel * distance), 0.0, 1.0);
    }

    /// Colour of a section, muted where the surface is coloured by a scalar.
    Colour section_colour(const Colour& colour) const {
        if (!scene.colouring().scalar) return colour;
        return 0.45 * colour + 0.55 * colour_from_hex("#c8ccd2");
    }

    /// Colour of the first hit within \p reach of a ray's start, else the background.
    Colour behind(const Vec3& start, const Vec3& direction, double reach, double y, std::uint32_t key) const {
        // Rays start at the drawn box, not at the far camera, for accuracy in Embree's single precision.
        const auto hit = scene.rays().closest_hit(start, direction, 0.0, reach);
        if (!hit) return background(y);
        Vec3 face = area_vector(scene.surface(), hit.triangle).normalized(),
             normal = scene.surface_normal(hit);
        if (face.dot(direction) > 0.0) {
            face = -face;
            normal = -normal;
        }
        if (normal.dot(face) <= 0.0) normal = face;
        Colour colour = scene.surface_colour(hit);
        if (options.edges) colour *= 1.0 - 0.7 * edge_cover(hit, (hit.point - camera.position).norm());
        const double open = openness(hit.point + 2e-4 * size * face, normal, key);
        // Deep shade would hide the colours of a scalar: halve the occlusion.
        return lit(colour, normal, scene.colouring().scalar ? 0.5 + 0.5 * open : open);
    }

    Colour sample(double x, double y, std::uint32_t key, SectionReader& sections) const {
        const Vec3 direction = camera.direction(x, y);
        const Span span = clip(box, camera.position, direction);
        if (!(span.enter < span.leave)) return background(y);
        const Vec3 entry = camera.position + span.enter * direction;
        const double reach = span.leave - span.enter;
        if (!scene.solid()) return behind(entry, direction, reach, y, key);
        // Sample a little inside: a surface that coincides with the box's face then lies clearly on one side.
        const SectionSample section =
            sections.at(entry + 1e-5 * size * direction, span.axis, pixel * span.enter);
        if (section.solid == 0.0) return behind(entry, direction, reach, y, key);
        Vec3 normal = Vec3::Zero();
        normal[span.axis] = direction[span.axis] > 0.0 ? -1.0 : 1.0;
        Colour front = lit((1.0 - 0.55 * section.line) * section_colour(section.colour), normal, 1.0);
        if (section.solid == 1.0) return front;
        return section.solid * front +
               (1.0 - section.solid) * behind(entry + section.offset_to_outside, direction, reach, y, key);
    }
};

}  // namespace

bool is_strip(const TriangleMesh& surface) {
    if (surface.vertices.empty()) return false;
    const Box3 box = bounding_box(surface);
    constexpr double kNarrow = 0.26;  // share of the x extent, which has at least four cells
    if (!(box.size().y() > 0.0 && box.size().y() < kNarrow * box.size().x())) return false;
    // Only contact lines of materials put vertices inside one cell; of two cells, a third of all lies inside.
    const auto inside = std::count_if(surface.vertices.begin(), surface.vertices.end(), [&](const Vec3& p) {
        return p.y() != box.min.y() && p.y() != box.max.y();
    });
    return 10 * inside < std::ssize(surface.vertices);
}

void PictureScale::extend(const Result& result) {
    box.extend(bounding_box(result.surface));
    for (const TriangleMesh& mesh : result.interfaces)
        box.min.z() = std::min(box.min.z(), bounding_box(mesh).min.z());
    materials.merge(materials_on(result));
    table = materials_of(result.metadata);
}

PictureScale scale_of(const Result& result, const RenderOptions& options) {
    PictureScale scale;
    scale.colouring = choose_colouring(result, options.color, options.range);
    scale.colouring.values.clear();
    scale.extend(result);
    return scale;
}

PictureKey key_of(const PictureScale& scale) {
    const Colouring& colouring = scale.colouring;
    if (colouring.scalar) return {true, colouring.title, colouring.low, colouring.high, {}};
    return {false, {}, 0.0, 1.0, legend(scale.materials, scale.table)};
}

Picture render(const Result& result, const RenderOptions& options) {
    return render(result, options, scale_of(result, options));
}

Picture render(const Result& result, const RenderOptions& options, const PictureScale& scale) {
    Colouring colouring = scale.colouring;
    if (colouring.scalar) {
        auto own = find_colouring(result, options.color, {});
        colouring.per_vertex = own && own->per_vertex;
        colouring.values =
            own ? std::move(own->values) : std::vector<double>(result.surface.triangles.size(), std::nan(""));
    }
    const RenderScene scene(result, std::move(colouring));
    const Box3 box = drawn_box(scale.box, scene, options);
    const PictureKey key = key_of(scale);
    const KeyColumn column = key_column(key, options.width, options.height);
    const Camera camera = frame(box, options, column.width / options.height);
    const Painter painter{scene, options, camera, box, box.size().norm(), camera.tangent / options.height};

    Picture picture(options.width, options.height);
    constexpr int kTile = 32;
    const int columns = (options.width + kTile - 1) / kTile, rows = (options.height + kTile - 1) / kTile;
    tbb::parallel_for(0, columns * rows, [&](int tile) {
        SectionReader sections(scene);
        const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
        for (int y = y0; y < std::min(y0 + kTile, options.height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, options.width); ++x) {
                Colour sum = Colour::Zero();
                for (int s = 0; s < 4; ++s) {
                    const double px = x + 0.25 + 0.5 * (s & 1), py = y + 0.25 + 0.5 * (s >> 1);
                    sum += painter.sample(
                        (2.0 * px - options.width) / options.height, 1.0 - 2.0 * py / options.height,
                        static_cast<std::uint32_t>(4 * (y * options.width + x) + s), sections);
                }
                picture.at(x, y) = sum / 4.0;
            }
    });
    if (!key.empty()) draw_key(picture, key, column);
    return picture;
}

}  // namespace sidewall::app
