#include "levelset/extract.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "levelset/openvdb_grid.hpp"
#include "surface/marching_cubes.hpp"

namespace sidewall::levelset {
namespace {

// The order of the leaves of a tree: by their places in its root, its nodes and their nodes.
bool before(const Leaf* a, const Leaf* b) {
    const auto place = [](const openvdb::Coord& c) {
        return std::array{c.x() >> 12, c.y() >> 12, c.z() >> 12, c.x() >> 7, c.y() >> 7,
                          c.z() >> 7,  c.x() >> 3,  c.y() >> 3,  c.z() >> 3};
    };
    return place(a->origin()) < place(b->origin());
}

// A grid's leaves. A periodic axis stores nodes 0..cells-1; cells on the high side also need node cells, the
// image of node 0: leaves that hold such images are copies.
struct Leaves {
    std::vector<const Leaf*> list;
    std::vector<std::unique_ptr<Leaf>> own;

    Leaves(const Grid& grid, const Domain& domain) : background_(grid.background()) {
        grid.tree().getNodes(list);
        for (int axis = 0; axis < 2; ++axis)
            if (domain.side[static_cast<std::size_t>(axis)] == Side::periodic) add_images(axis, domain);
        if (!own.empty()) std::sort(list.begin(), list.end(), before);
    }

  private:
    void add_images(int axis, const Domain& domain) {
        std::vector<std::pair<openvdb::Coord, float>> images;
        for (const Leaf* leaf : list) {
            if (leaf->origin()[axis] != 0) continue;
            for (auto it = leaf->cbeginValueOn(); it; ++it) {
                openvdb::Coord c = it.getCoord();
                if (c[axis] != 0) continue;
                c[axis] = domain.cells[static_cast<std::size_t>(axis)];
                images.emplace_back(c, *it);
            }
        }
        const std::size_t known = own.size();
        std::map<openvdb::Coord, Leaf*> to;  // by origin
        for (std::size_t n = 0; n < known; ++n) to[own[n]->origin()] = own[n].get();
        for (const auto& [c, v] : images) to.try_emplace(c & ~7, nullptr);
        for (const Leaf*& leaf : list) {
            const auto copied = to.find(leaf->origin());
            if (copied == to.end() || copied->second != nullptr) continue;
            leaf = copied->second = own.emplace_back(std::make_unique<Leaf>(*leaf)).get();
        }
        for (auto& [origin, leaf] : to)
            if (leaf == nullptr)
                list.push_back(
                    leaf = own.emplace_back(std::make_unique<Leaf>(origin, background_, false)).get());
        for (const auto& [c, v] : images) to.at(c & ~7)->setValueOn(c, v);
    }

    float background_;
};

}  // namespace

TriangleMesh extract_surface(const Grid& grid, const Domain& domain) {
    const surface::LateralGrid box{domain.min, domain.max, domain.cells, domain.spacing};
    return surface::marching_cubes(Leaves(grid, domain).list, box);
}

}  // namespace sidewall::levelset
