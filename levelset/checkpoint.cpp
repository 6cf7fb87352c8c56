#include "levelset/checkpoint.hpp"

#include <fmt/format.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tree/LeafManager.h>

#include <atomic>
#include <cmath>
#include <new>

#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/printable.hpp"
#include "surface/sealed_file.hpp"

namespace sidewall::levelset {
namespace {

// Raised with every change of what a checkpoint holds, the caller's text included.
constexpr std::uint32_t kVersion = 1;

constexpr const char* kText = "sidewall";
constexpr const char* kMaterial = "material";

std::string domain_text(const Domain& domain) {
    return fmt::format("{} {} {} {} {} {} {} {} {}", domain.min[0], domain.min[1], domain.max[0],
                       domain.max[1], domain.cells[0], domain.cells[1], domain.spacing,
                       static_cast<int>(domain.side[0]), static_cast<int>(domain.side[1]));
}

// What everything that reads a level set relies on.
void check(const Grid& grid, const Domain& domain) {
    if (grid.background() != static_cast<float>(kHalfWidth * domain.spacing))
        throw FileError("a layer's narrow band has another width");
    std::atomic<bool> good = true;
    openvdb::tree::LeafManager<const Grid::TreeType> leaves(grid.tree());
    leaves.foreach ([&](const Leaf& leaf, std::size_t) {
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n)
            if (!std::isfinite(leaf.getValue(n))) good = false;
    });
    if (!good) throw FileError("a layer holds a distance that is not finite");
}

Layer layer_of(const openvdb::GridBase::Ptr& grid, const Domain& domain) {
    const GridPtr phi = openvdb::gridPtrCast<Grid>(grid);
    if (!phi) throw FileError("it holds something other than layers");
    check(*phi, domain);
    return {grid->metaValue<std::int32_t>(kMaterial), phi};
}

}  // namespace

void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text) {
    openvdb::GridPtrVec grids;
    for (std::size_t k = 0; k < stack.layers.size(); ++k) {
        // Shares the tree.
        const GridPtr grid = openvdb::gridPtrCast<Grid>(stack.layers[k].phi->copyGrid());
        grid->setName(fmt::format("layer_{}", k));
        grid->insertMeta(kMaterial, openvdb::Int32Metadata(stack.layers[k].material));
        grid->setSaveFloatAsHalf(false);
        grids.push_back(grid);
    }
    openvdb::MetaMap meta;
    meta.insertMeta(kText, openvdb::StringMetadata(text));
    meta.insertMeta("domain", openvdb::StringMetadata(domain_text(stack.domain)));
    // OpenVDB's own files do not notice a full disk.
    surface::write_sealed_file(path, kVersion,
                               [&](std::ostream& out) { openvdb::io::Stream(out).write(grids, meta); });
}

Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain) {
    initialize();
    if (!std::filesystem::exists(path))
        throw FileError(fmt::format("{}: there is no checkpoint", path.string()));
    Checkpoint checkpoint{{domain, {}}, {}};
    try {
        std::ifstream in = surface::open_sealed_file(path, kVersion);
        openvdb::io::Stream file(in, false);  // no delayed loading: the file will be replaced
        const openvdb::MetaMap::Ptr meta = file.getMetadata();
        checkpoint.text = meta->metaValue<std::string>(kText);
        if (meta->metaValue<std::string>("domain") != domain_text(domain))
            throw FileError("it belongs to another domain or grid spacing");
        const openvdb::GridPtrVecPtr grids = file.getGrids();
        for (std::size_t k = 0; k < grids->size(); ++k)
            for (const auto& grid : *grids)
                if (grid->getName() == fmt::format("layer_{}", k))
                    checkpoint.stack.layers.push_back(layer_of(grid, domain));
        if (checkpoint.stack.layers.empty() || checkpoint.stack.layers.size() != grids->size())
            throw FileError("it does not hold a stack of layers");
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw FileError(
            fmt::format("{}: not a usable checkpoint: {}", path.string(), surface::printable(error.what())));
    }
    return checkpoint;
}

}  // namespace sidewall::levelset
