#include "app/report/view.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/geometry/algorithms/simplify.hpp>
#include <boost/geometry/geometries/register/linestring.hpp>
#include <boost/geometry/geometries/register/point.hpp>
#include <boost/geometry/strategies/cartesian/distance_projected_point.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "app/common/text.hpp"
#include "app/pictures/render_scene.hpp"
#include "app/report/view_mesh.hpp"

BOOST_GEOMETRY_REGISTER_POINT_3D(sidewall::Vec3, double, boost::geometry::cs::cartesian, x(), y(), z())
BOOST_GEOMETRY_REGISTER_LINESTRING(std::vector<sidewall::Vec3>)

namespace sidewall::app {
namespace {

constexpr std::size_t kMostFrames = 100, kMostLines = 40, kMostAttributes = 12;

// Levels of coarsening, in cells: error bound, longest edge. The last still shows features of some cells.
constexpr ViewDetail kDetails[] = {{0.0, 0.0}, {0.01, 2.0}, {0.025, 3.0}, {0.05, 4.0},
                                   {0.1, 6.0}, {0.2, 8.0},  {0.5, 16.0},  {1.0, 32.0}};

struct Frame {
    ViewMesh surface;
    std::vector<std::pair<std::string, int>> layers;  // digest of each interface, material below it
    int top = 0;                                      // material of the uppermost layer
    Box3 box;
    std::size_t triangles = 0;                                  // before coarsening
    std::vector<std::vector<std::vector<Vec3>>> profiles = {};  // points by plane, then line
};

struct Scene {
    std::vector<std::string> attributes;
    surface::MeshMetadata metadata;
    std::vector<Frame> frames;
    std::map<std::string, ViewMesh> interfaces;
    double cell = 0.0;  // largest of all frames

    std::size_t size() const {
        std::size_t bytes = 0;
        for (const Frame& frame : frames) bytes += encoded_size(frame.surface);
        for (const auto& [digest, mesh] : interfaces) bytes += encoded_size(mesh);
        return bytes;
    }
};

// At most \p most of the items: the first, the last and others evenly spaced between them.
template <class T>
std::vector<T> thinned(std::vector<T> items, std::size_t most) {
    if (items.size() <= most) return items;
    std::vector<T> kept;
    for (std::size_t k = 0; k < most; ++k) kept.push_back(items[k * (items.size() - 1) / (most - 1)]);
    return kept;
}

std::string digest_of(const TriangleMesh& mesh) {
    const auto bytes = [](const auto& items) {
        return std::string_view(reinterpret_cast<const char*>(items.data()), items.size() * sizeof items[0]);
    };
    return digest(bytes(mesh.vertices)) + digest(bytes(mesh.triangles));
}

// Names of the scalar attributes to show. Rates and fluxes come first, because only kMostAttributes are kept.
std::vector<std::string> attributes_of(const std::vector<ViewFrame>& frames) {
    std::vector<std::string> names;
    for (const ViewFrame& frame : {frames.front(), frames[frames.size() / 2], frames.back()}) {
        const TriangleMesh mesh = frame.wafer ? frame.wafer->surface : surface::read_mesh(frame.saved.file);
        for (const char* start : {"rate", "flux_", "coverage_", ""})
            for (const Attribute& a : mesh.triangle_attributes)
                if (a.components == 1 && a.name != "material" && a.name.starts_with(start) &&
                    std::find(names.begin(), names.end(), a.name) == names.end())
                    names.push_back(a.name);
    }
    if (names.size() > kMostAttributes) names.resize(kMostAttributes);
    return names;
}

std::vector<std::vector<Vec3>> drawn_profile(const TriangleMesh& mesh, const surface::Plane& plane,
                                             double cell) {
    constexpr double kOff = 0.02;  // largest distance of a simplified line, in cells
    std::vector<std::vector<Vec3>> lines;
    for (const surface::Polyline& polyline : surface::cut_by_plane(mesh, plane)) {
        std::vector<Vec3> points = polyline.points;
        if (points.size() < 2) continue;
        if (polyline.closed) points.push_back(points.front());
        // Simplifies within that distance by the algorithm of Douglas and Peucker (1973).
        boost::geometry::simplify(points, lines.emplace_back(), kOff * cell);
    }
    return lines;
}

int most_frequent_material(const TriangleMesh& mesh) {
    std::map<int, std::size_t> count;
    for (const int id : triangle_materials(mesh)) ++count[std::clamp(id, 0, 255)];
    const auto most = std::ranges::max_element(count, {}, &std::pair<const int, std::size_t>::second);
    return most == count.end() ? 0 : most->first;
}

Frame read_frame(const ViewFrame& source, const ViewDetail& detail, const std::vector<surface::Plane>& planes,
                 Scene& scene, std::mutex& lock) {
    const Result result = source.wafer ? *source.wafer : read_saved(source.folder, source.saved);
    const double cell = cell_size(result.surface);
    Frame frame{.surface = view_mesh(result.surface, scene.attributes, detail, cell),
                .box = bounding_box(result.surface),
                .triangles = result.surface.triangles.size()};
    frame.top = uppermost_material(result).value_or(most_frequent_material(result.surface));
    for (const surface::Plane& plane : planes)
        frame.profiles.push_back(drawn_profile(result.surface, plane, cell));
    for (const TriangleMesh& mesh : result.interfaces) {
        const std::string digest = digest_of(mesh);
        const Box3 box = bounding_box(mesh);
        frame.box.min.z() = std::min(frame.box.min.z(), box.min.z());
        frame.layers.emplace_back(digest, most_frequent_material(mesh));
        {
            const std::lock_guard guard(lock);
            if (scene.interfaces.contains(digest)) continue;
        }
        // Without the lock: two threads may make the same mesh twice, with equal results.
        ViewMesh made = bare_view_mesh(mesh, detail, cell);
        const std::lock_guard guard(lock);
        scene.interfaces.try_emplace(digest, std::move(made));
    }
    const std::lock_guard guard(lock);
    scene.cell = std::max(scene.cell, cell);
    return frame;
}

void read_frames(const std::vector<ViewFrame>& sources, const ViewDetail& detail,
                 const std::vector<surface::Plane>& planes, Scene& scene) {
    std::mutex lock;
    scene.interfaces.clear();
    scene.frames.assign(sources.size(), {});
    tbb::parallel_for(std::size_t{0}, sources.size(), [&](std::size_t k) {
        scene.frames[k] = read_frame(sources[k], detail, planes, scene, lock);
    });
}

// Estimates the finest level of detail whose text fits into \p bytes, from a sample of the frames.
std::size_t likely_detail(const std::vector<ViewFrame>& frames, Scene& scene, std::size_t bytes) {
    constexpr std::size_t kSamples = 4;
    std::vector<ViewFrame> some = frames;
    if (frames.size() > kSamples) {
        some.clear();
        for (std::size_t k = 0; k < kSamples; ++k)
            some.push_back(frames[(2 * k + 1) * frames.size() / (2 * kSamples)]);
    }
    const auto fits = [&](std::size_t d) {
        read_frames(some, kDetails[d], {}, scene);
        return static_cast<double>(scene.size() * frames.size()) <= static_cast<double>(bytes * some.size());
    };
    std::size_t d = 0;
    while (d + 1 < std::size(kDetails) && !fits(d)) ++d;
    return d;
}

// Ends of the colour bar of each attribute, over all frames.
std::vector<std::array<double, 2>> ranges_of(const Scene& scene) {
    std::vector<std::array<double, 2>> ranges;
    for (std::size_t a = 0; a < scene.attributes.size(); ++a) {
        std::vector<double> values;
        for (const Frame& frame : scene.frames) {
            const std::vector<float>& own = frame.surface.values[a];
            values.insert(values.end(), own.begin(), own.end());
        }
        auto [low, high] = usual_range(std::move(values));
        if (!(high > low)) high = low + std::max(std::abs(low), 1.0) * 1e-3;
        ranges.push_back({low, high});
    }
    return ranges;
}

std::string attribute_label(const std::string& name) {
    if (name.starts_with("flux_")) return "flux of " + name.substr(5);
    if (name.starts_with("coverage_")) return "coverage " + name.substr(9);
    return name;
}

std::string attribute_unit(const std::string& name, const std::string& length, const std::string& time) {
    if (name.starts_with("flux_")) return "relative to an open plane";
    if (name == "rate") return shown_unit(length + "/" + time);
    return "";
}

Json numbers(const Vec3& v) {
    return Json::array({number_or_null(v.x(), 9), number_or_null(v.y(), 9), number_or_null(v.z(), 9)});
}

Json scene_json(const std::vector<ViewFrame>& sources, const Scene& scene) {
    const std::string length = metadata_text(scene.metadata, "length_unit", ""),
                      time = metadata_text(scene.metadata, "time_unit", "");
    Box3 box;
    for (const Frame& frame : scene.frames) box.extend(frame.box);
    Json json{{"type", "view"},
              {"title", "Surface and materials"},
              {"length_unit", shown_unit(length)},
              {"min", numbers(box.min)},
              {"max", numbers(box.max)}};
    const auto ranges = ranges_of(scene);
    json["attributes"] = Json::array();
    for (std::size_t a = 0; a < ranges.size(); ++a)
        json["attributes"].push_back(Json{{"label", attribute_label(scene.attributes[a])},
                                          {"unit", attribute_unit(scene.attributes[a], length, time)},
                                          {"low", number_or_null(ranges[a][0], 6)},
                                          {"high", number_or_null(ranges[a][1], 6)}});
    const Materials table = materials_of(scene.metadata);
    std::set<int> shown;
    std::map<std::string, std::size_t> number;
    json["meshes"] = Json::array();
    json["frames"] = Json::array();
    for (std::size_t k = 0; k < scene.frames.size(); ++k) {
        const Frame& frame = scene.frames[k];
        Json layers = Json::array();
        for (const auto& [digest, material] : frame.layers) {
            const auto [place, fresh] = number.try_emplace(digest, json["meshes"].size());
            if (fresh) json["meshes"].push_back(encode(scene.interfaces.at(digest), box, {}));
            layers.push_back(Json::array({place->second, material}));
            shown.insert(material);
        }
        shown.insert(frame.surface.material.begin(), frame.surface.material.end());
        shown.insert(frame.top);
        json["frames"].push_back(Json{{"label", sources[k].label},
                                      {"surface", encode(frame.surface, box, ranges)},
                                      {"layers", std::move(layers)},
                                      {"top", frame.top}});
    }
    json["materials"] = Json::array();
    for (const int id : shown) {
        const Material material = material_of(id, table);
        json["materials"].push_back(Json{{"id", id}, {"name", material.name}, {"colour", material.colour}});
    }
    return json;
}

Json profile_charts(const std::vector<ViewFrame>& sources, const std::vector<surface::Plane>& planes,
                    const Scene& scene) {
    const std::string unit = shown_unit(metadata_text(scene.metadata, "length_unit", ""));
    std::vector<std::size_t> chosen(scene.frames.size());
    for (std::size_t k = 0; k < chosen.size(); ++k) chosen[k] = k;
    chosen = thinned(chosen, kMostLines);
    Json charts = Json::array();
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const auto axes = surface::plane_axes(planes[p]);
        const auto name = [](const Vec3& axis) {
            return axis.x() != 0.0 ? "x" : axis.y() != 0.0 ? "y" : "z";
        };
        Json chart{{"title", fmt::format("Section {} = {:.6g}{}{}", name(planes[p].normal), planes[p].offset,
                                         unit.empty() ? "" : " ", unit)},
                   {"x", with_unit(name(axes[0]), unit)},
                   {"y", with_unit(name(axes[1]), unit)},
                   {"same_scale", true},
                   {"ramp", true},
                   {"series", Json::array()}};
        for (const std::size_t k : chosen) {
            Json points = Json::array();
            for (const auto& line : scene.frames[k].profiles[p]) {
                if (!points.empty()) points.push_back(nullptr);
                for (const Vec3& v : line)
                    points.push_back(
                        Json::array({number_or_null(v.dot(axes[0]), 5), number_or_null(v.dot(axes[1]), 5)}));
            }
            chart["series"].push_back(Json{{"name", sources[k].label}, {"points", std::move(points)}});
        }
        charts.push_back(std::move(chart));
    }
    return charts;
}

}  // namespace

View make_view(std::vector<ViewFrame> frames, const std::vector<surface::Plane>& planes, std::size_t bytes) {
    View view{.section = Json{{"type", "view"}, {"title", "Surface and materials"}},
              .profiles = Json::array()};
    const std::size_t saved = frames.size();
    frames = thinned(std::move(frames), kMostFrames);
    Scene scene{.attributes = attributes_of(frames)};
    if (frames.back().wafer)
        scene.metadata = frames.back().wafer->metadata;
    else
        surface::read_mesh(frames.back().saved.file, &scene.metadata);
    // The charts of profiles take about 4000 bytes a line.
    const std::size_t most =
        bytes - std::min(bytes, 4000 * planes.size() * std::min(frames.size(), kMostLines));
    std::size_t d = likely_detail(frames, scene, most);
    for (;; ++d) {
        read_frames(frames, kDetails[d], planes, scene);
        if (scene.size() <= most) break;
        if (d + 1 == std::size(kDetails)) {
            if (frames.size() <= 2) break;
            const std::size_t half = std::max<std::size_t>(2, frames.size() / 2);
            frames = thinned(std::move(frames), half);
            --d;
        }
    }
    view.profiles = profile_charts(frames, planes, scene);
    if (scene.size() > most) {
        view.section["note"] =
            "The surfaces have too many triangles for this page: draw them with `sidewall render`.";
        return view;
    }
    view.section = scene_json(frames, scene);
    view.shown = frames.size();
    for (int axis = 0; axis < 3 && !planes.empty(); ++axis)
        if (planes[0].normal == Vec3::Unit(axis))
            view.section["cut"] = Json{{"axis", axis}, {"at", number_or_null(planes[0].offset, 9)}};
    std::size_t triangles = 0;
    for (const Frame& frame : scene.frames) triangles += frame.triangles;
    std::string note;
    if (frames.size() < saved) note = fmt::format("{} of {} surfaces are shown. ", frames.size(), saved);
    if (kDetails[d].max_error > 0.0)
        note += fmt::format(
            "Surfaces are coarsened for this page by region-bounded simplification: their vertices are at most {:.2g} "
            "{} ({:.3g} grid spacings) away from the saved surface.",
            kDetails[d].max_error * scene.cell, shown_unit(metadata_text(scene.metadata, "length_unit", "")),
            kDetails[d].max_error);
    else
        note += "Surfaces are shown as saved.";
    view.section["note"] = note;
    view.section["saved_triangles"] = triangles;
    return view;
}

std::string shown_unit(const std::string& unit) {
    if (unit == "1") return "";
    std::string shown = unit;
    if (shown.starts_with("um")) shown.replace(0, 1, "\u00b5");
    for (const auto& [plain, raised] : {std::pair("^2", "\u00b2"), std::pair("^3", "\u00b3")})
        if (const std::size_t at = shown.find(plain); at != std::string::npos) shown.replace(at, 2, raised);
    if (shown == "deg") shown = "\u00b0";
    return shown;
}

std::string with_unit(const std::string& name, const std::string& unit) {
    const std::string shown = shown_unit(unit);
    return shown.empty() ? name : fmt::format("{} [{}]", name, shown);
}

std::string axis_label(const std::string& name, const std::string& unit) {
    const std::string shown = shown_unit(unit);
    return fmt::format("{} [{}]", name, shown.empty() ? "1" : shown);
}

}  // namespace sidewall::app
