#include "simplify/edge_cost.hpp"

#include <catch2/catch.hpp>

using namespace sidewall;
using namespace sidewall::simplify;

namespace {

/// Cost of the edge, \p length long, between the two tops of a low tent. The triangles beside it are 1 high.
double tent_cost(double length) {
    TriangleMesh tent;
    tent.vertices = {{-0.5 * length, 0, 0.1},
                     {0.5 * length, 0, 0.1},
                     {0, 1, 0},
                     {-1, 0.3, 0},
                     {-1, -0.3, 0},
                     {0, -1, 0},
                     {1, -0.3, 0},
                     {1, 0.3, 0}};
    tent.triangles = {{0, 1, 2}, {1, 0, 5}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {1, 5, 6}, {1, 6, 7}, {1, 7, 2}};
    const CollapseMesh mesh(tent);
    return edge_cost(mesh, 0, kVolumeWeights).cost;
}

}  // namespace

TEST_CASE("the short edge of a needle costs a sixteenth") {
    // The angle opposite to the edge is 5 degrees at a length of about 0.0877; only there the cost jumps.
    CHECK(tent_cost(0.091) / tent_cost(0.088) < 2.0);
    CHECK(tent_cost(0.087) / tent_cost(0.084) < 2.0);
    CHECK(tent_cost(0.089) / tent_cost(0.086) > 8.0);
}
