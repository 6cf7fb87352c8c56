#include "simplify/vertex_kind.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

using namespace sidewall;
using namespace sidewall::simplify;

namespace {

struct Named {
    const char* name;
    VertexConstraint constraint;
};

// Every vertex kind, with every side and corner of the unit square.
const std::vector<Named> kVertices = {{"interior", {}},
                                      {"boundary", {VertexKind::boundary, 0}},
                                      {"side x0", {VertexKind::side, kMinX}},
                                      {"side x1", {VertexKind::side, kMaxX}},
                                      {"side y0", {VertexKind::side, kMinY}},
                                      {"side y1", {VertexKind::side, kMaxY}},
                                      {"corner x0 y0", {VertexKind::corner, kMinX | kMinY}},
                                      {"corner x1 y0", {VertexKind::corner, kMaxX | kMinY}},
                                      {"corner x0 y1", {VertexKind::corner, kMinX | kMaxY}},
                                      {"corner x1 y1", {VertexKind::corner, kMaxX | kMaxY}},
                                      {"frozen", {VertexKind::frozen, 0}},
                                      {"frozen x0", {VertexKind::frozen, kMinX}}};

// s: at the start, e: at the end, b: along the boundary, f: free, -: nowhere.
char letter(MergedPlace place) {
    switch (place) {
        case MergedPlace::nowhere:
            return '-';
        case MergedPlace::start:
            return 's';
        case MergedPlace::end:
            return 'e';
        case MergedPlace::boundary:
            return 'b';
        case MergedPlace::free:
            return 'f';
    }
    return '?';
}

// One row for each start, one column for each end, both in the order of kVertices.
std::vector<std::string> table(bool boundary_edge) {
    std::vector<std::string> rows;
    for (const Named& start : kVertices) {
        rows.emplace_back();
        for (const Named& end : kVertices)
            rows.back() += letter(merged_place(start.constraint, end.constraint, boundary_edge));
    }
    return rows;
}

}  // namespace

TEST_CASE("where a merged vertex may lie, kind by kind") {
    // clang-format off
    CHECK(table(true) == std::vector<std::string>{
        // i b  sides  corners frozen
        "f" "e" "eeee" "eeee" "--",   // interior
        "s" "b" "eeee" "eeee" "--",   // boundary
        "s" "s" "b---" "e-e-" "--",   // side x0
        "s" "s" "-b--" "-e-e" "--",   // side x1
        "s" "s" "--b-" "ee--" "--",   // side y0
        "s" "s" "---b" "--ee" "--",   // side y1
        "s" "s" "s-s-" "s---" "--",   // corner x0 y0
        "s" "s" "-ss-" "-s--" "--",   // corner x1 y0
        "s" "s" "s--s" "--s-" "--",   // corner x0 y1
        "s" "s" "-s-s" "---s" "--",   // corner x1 y1
        "-" "-" "----" "----" "--",   // frozen
        "-" "-" "----" "----" "--"}); // frozen x0
    CHECK(table(false) == std::vector<std::string>{
        "f" "e" "eeee" "eeee" "--",   // interior
        "s" "-" "----" "----" "--",   // boundary
        "s" "-" "----" "----" "--",   // side x0
        "s" "-" "----" "----" "--",   // side x1
        "s" "-" "----" "----" "--",   // side y0
        "s" "-" "----" "----" "--",   // side y1
        "s" "-" "----" "----" "--",   // corner x0 y0
        "s" "-" "----" "----" "--",   // corner x1 y0
        "s" "-" "----" "----" "--",   // corner x0 y1
        "s" "-" "----" "----" "--",   // corner x1 y1
        "-" "-" "----" "----" "--",   // frozen
        "-" "-" "----" "----" "--"}); // frozen x0
    // clang-format on
}

TEST_CASE("a merged vertex is held by all that held either, where it was put by what held one of them") {
    for (const bool boundary_edge : {true, false})
        for (const Named& start : kVertices)
            for (const Named& end : kVertices) {
                const VertexConstraint &s = start.constraint, &e = end.constraint;
                const MergedPlace place = merged_place(s, e, boundary_edge);
                if (place == MergedPlace::nowhere) continue;
                INFO(start.name << " to " << end.name);
                const VertexConstraint both = merged(s, e), kept = place == MergedPlace::end ? e : s;
                CHECK(both.planes == kept.planes);
                CHECK(both.kind == kept.kind);
            }
}

TEST_CASE("an edge and the same edge turned round go to the same vertex") {
    for (const bool boundary_edge : {true, false})
        for (const Named& a : kVertices)
            for (const Named& b : kVertices) {
                INFO(a.name << ", " << b.name);
                const MergedPlace there = merged_place(a.constraint, b.constraint, boundary_edge),
                                  back = merged_place(b.constraint, a.constraint, boundary_edge);
                const bool alike = a.constraint.kind == b.constraint.kind;
                if (there == MergedPlace::end)
                    CHECK(back == MergedPlace::start);
                else if (there == MergedPlace::start && !alike)
                    CHECK(back == MergedPlace::end);
                else
                    CHECK(back == there);
            }
}

TEST_CASE("kind and planes of a boundary vertex come from the box to the last bit") {
    const Box3 box{Vec3(0.1, -1.0, 0.0), Vec3(0.7, 2.0, 5.0)};
    const auto at = [&](double x, double y) { return boundary_constraint(Vec3(x, y, 5.0), box); };
    CHECK(at(0.3, 0.0).kind == VertexKind::boundary);
    CHECK(at(0.1, 0.0).kind == VertexKind::side);
    CHECK(at(0.1, 0.0).planes == kMinX);
    CHECK(at(std::nextafter(0.1, 1.0), 0.0).kind == VertexKind::boundary);
    CHECK(at(0.3, 2.0).planes == kMaxY);
    CHECK(at(0.7, -1.0).kind == VertexKind::corner);
    CHECK(at(0.7, -1.0).planes == (kMaxX | kMinY));
    Vec3 p(0.4, 0.5, 0.6);
    move_into(at(0.7, -1.0).planes, p, box.min, box.max);
    CHECK(p == Vec3(0.7, -1.0, 0.6));

    // A mesh without extent along x lies in both planes across x, which do not make a corner.
    const Box3 wall{Vec3(0.1, -1.0, 0.0), Vec3(0.1, 2.0, 5.0)};
    const VertexConstraint inner = boundary_constraint(Vec3(0.1, 0.0, 5.0), wall);
    CHECK(inner.kind == VertexKind::side);
    CHECK(inner.planes == (kMinX | kMaxX));
    CHECK(merged_place(inner, inner, true) == MergedPlace::boundary);
    CHECK(merged_place(inner, boundary_constraint(Vec3(0.1, 2.0, 0.0), wall), true) == MergedPlace::end);
}
