#include "app/process/events.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/recipe/layers.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/face_points.hpp"
#include "levelset/meshes/volume.hpp"

namespace sidewall::app {
namespace {

using levelset::SurfacePiece;

bool overlap(const std::vector<Box3>& some, const std::vector<Box3>& others) {
    return std::any_of(some.begin(), some.end(), [&](const Box3& a) {
        return std::any_of(others.begin(), others.end(), [&](const Box3& b) { return overlap(a, b); });
    });
}

// A material counts as gone when less than this share of its largest volume is left. Traces stay for ever in
// corners that an etch front rounds off by a part of a cell (0.25 dx^2 along each corner of a trench whose
// film is stripped: events_test.cpp, "a material that vanishes").
constexpr double kVanishedShare = 0.01;

// Names of the materials bare on the pieces, by decreasing area; traces in corners are left out.
std::string bare_materials(const Recipe& recipe, const levelset::MaterialStack& stack,
                           const TriangleMesh& surface, const std::vector<const SurfacePiece*>& pieces) {
    constexpr double kLeastShare = 0.05;
    const std::vector<std::uint32_t> part = levelset::piece_of_vertices(surface, stack.domain);
    std::vector<double> area(recipe.materials.size(), 0.0);
    double whole = 0.0;
    const levelset::FacePoints faces(surface);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const std::uint32_t p = part[surface.triangles[t][0]];
        if (std::none_of(pieces.begin(), pieces.end(),
                         [p](const SurfacePiece* piece) { return piece->part == p; }))
            continue;
        const double here = triangle_area(surface, t);
        const int material = levelset::exposed_material(stack, faces.of(t));
        area[static_cast<std::size_t>(material)] += here;
        whole += here;
    }
    std::vector<std::size_t> shown;
    for (std::size_t m = 0; m < area.size(); ++m)
        if (area[m] > kLeastShare * whole) shown.push_back(m);
    std::stable_sort(shown.begin(), shown.end(),
                     [&](std::size_t a, std::size_t b) { return area[a] > area[b]; });
    std::string names;
    for (const std::size_t m : shown) names += (names.empty() ? "" : ", ") + recipe.materials[m].name;
    return names;
}

// Compares the surface at one time with the run's history and adds the events found.
struct EventFinder {
    const Recipe& recipe;
    const TriangleMesh& surface;
    RunState& state;
    std::size_t step;
    const std::vector<SurfacePiece>& pieces;

    Event& add(const char* kind) {
        return state.history.events.emplace_back(
            Event{kind, state.process_time(), step, {}, 1, 0.0, Vec3::Zero()});
    }

    // The point, with coordinates that only rounding keeps from zero set to 0.
    Vec3 place(Vec3 p) const {
        for (double& x : p)
            if (std::abs(x) < 1e-6 * state.stack.domain.spacing) x = 0.0;
        return p;
    }

    // Adds an event for pieces that overlap no known ones; the present pieces become the known ones.
    void pieces_of(const char* kind, bool (SurfacePiece::*is)() const, std::vector<Box3>& known) {
        const double cell = std::pow(state.stack.domain.spacing, 3);
        std::vector<Box3> now;
        std::vector<const SurfacePiece*> fresh;
        for (const SurfacePiece& piece : pieces) {
            if (!(piece.*is)() || (piece.cover == 0 && std::abs(piece.volume) < cell)) continue;
            now.insert(now.end(), piece.boxes.begin(), piece.boxes.end());
            if (!overlap(piece.boxes, known)) fresh.push_back(&piece);
        }
        known = std::move(now);
        if (fresh.empty()) return;
        Event& event = add(kind);
        const SurfacePiece* largest = fresh.front();
        for (const SurfacePiece* piece : fresh) {
            event.volume += std::abs(piece->volume);
            if (std::abs(piece->volume) > std::abs(largest->volume)) largest = piece;
        }
        event.count = fresh.size();
        event.at = place(surface.vertices[largest->top]);
        if (event.kind == kDetached) event.material = bare_materials(recipe, state.stack, surface, fresh);
    }

    void ends() {
        History& history = state.history;
        const double room = kMostCells * recipe.domain.grid_spacing;
        bool open_below = true;  // until a piece covers the whole domain, seen from above
        Vec3 lowest = surface.vertices[pieces.front().top], highest = lowest;
        for (const SurfacePiece& piece : pieces) {
            open_below = open_below && piece.cover <= 0;
            const Vec3& top = surface.vertices[piece.top];
            if (top.z() > highest.z()) highest = top;
        }
        for (const Vec3& p : surface.vertices)
            if (p.z() < lowest.z()) lowest = p;
        const auto reached = [&](bool is, bool& was, const char* kind, const Vec3& at) {
            if (is && !was) add(kind).at = place(at);
            was = was || is;
        };
        reached(open_below || lowest.z() <= -room, history.bottom_reached, kBottomReached, lowest);
        reached(highest.z() >= room, history.top_reached, kTopReached, highest);
    }

    void materials() {
        const levelset::MaterialStack& stack = state.stack;
        History& history = state.history;
        history.found.resize(stack.layers.size(), 0);
        std::vector<double> left(recipe.materials.size(), 0.0);
        std::vector<std::uint8_t> present(left.size(), 0);
        for (std::size_t k = 0; k < stack.layers.size(); ++k) {
            const auto m = static_cast<std::size_t>(stack.layers[k].material);
            const double enough = kVanishedShare * history.most[m];
            if (present[m] != 0) continue;
            left[m] += levelset::volume_left(stack, k, enough - left[m], history.found[k]);
            present[m] = left[m] > 0.0 && left[m] >= enough;
        }
        history.present.resize(present.size(), 0);
        for (std::size_t m = 0; m < present.size(); ++m)
            if (history.present[m] != 0 && present[m] == 0)
                add(kVanished).material = recipe.materials[m].name;
        history.present = std::move(present);
    }
};

}  // namespace

std::size_t note_events(const Recipe& recipe, const TriangleMesh& surface,
                        const std::vector<SurfacePiece>& pieces, std::size_t step, RunState& state) {
    const std::size_t before = state.history.events.size();
    if (pieces.empty()) return 0;
    EventFinder finder{recipe, surface, state, step, pieces};
    finder.materials();
    finder.pieces_of(kDetached, &SurfacePiece::hangs, state.history.hanging);
    finder.pieces_of(kVoidClosed, &SurfacePiece::shuts_in, state.history.voids);
    finder.ends();
    return state.history.events.size() - before;
}

void begin_events(const Recipe& recipe, RunState& state) {
    const TriangleMesh surface = levelset::extract_surface(state.stack);
    note_events(recipe, surface, levelset::surface_pieces(surface, state.stack), 0, state);
    state.history.events.clear();
}

std::string event_line(const Recipe& recipe, const std::vector<Step>& steps, const Event& event) {
    const std::string& length = recipe.domain.length_unit;
    // A piece that lies across the whole domain encloses no volume.
    const bool several = event.count > 1;
    const std::string size =
        event.volume > 0.0
            ? fmt::format("{:.3g} {}, ", event.volume / volume_divisor(recipe), volume_unit(recipe))
            : "";
    const std::string where =
        fmt::format("{}the top {}at ({:.4g}, {:.4g}, {:.4g}) {}", size, several ? "of the largest " : "",
                    event.at.x(), event.at.y(), event.at.z(), length);
    std::string what;
    if (event.kind == kVanished)
        what = fmt::format("{} has vanished: less than {:g} % of it is left", event.material,
                           100.0 * kVanishedShare);
    else if (event.kind == kDetached)
        what = several ? fmt::format("{} pieces of {} have come loose and hang in the gas: {}", event.count,
                                     event.material, where)
                       : fmt::format("a piece of {} has come loose and hangs in the gas: {}", event.material,
                                     where);
    else if (event.kind == kVoidClosed)
        what = several ? fmt::format("{} voids have closed: {}", event.count, where)
                       : fmt::format("a void has closed: {}", where);
    else
        what =
            fmt::format("the surface has reached the {}, z = {:.6g} {}",
                        event.kind == kBottomReached ? "bottom of the substrate" : "top of the films' room",
                        event.at.z(), length);
    return fmt::format("{:.6g} {}, step {}: {}", event.time, recipe.domain.time_unit, steps[event.step].name,
                       what);
}

}  // namespace sidewall::app
