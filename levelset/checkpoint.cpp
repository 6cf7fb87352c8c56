#include "levelset/checkpoint.hpp"

#include <fmt/format.h>
#include <openvdb/io/File.h>

#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"

namespace sidewall::levelset {
namespace {

constexpr const char* kText = "sidewall";
constexpr const char* kMaterial = "material";

std::string domain_text(const Domain& domain) {
    return fmt::format("{} {} {} {} {} {} {} {} {}", domain.min[0], domain.min[1], domain.max[0],
                       domain.max[1], domain.cells[0], domain.cells[1], domain.spacing,
                       static_cast<int>(domain.side[0]), static_cast<int>(domain.side[1]));
}

}  // namespace

void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text) {
    try {
        surface::write_through_partial(path, [&](const std::filesystem::path& partial) {
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
            openvdb::io::File file(partial.string());
            file.write(grids, meta);
            file.close();
        });
    } catch (const std::exception& error) {
        throw IoError(fmt::format("{}: cannot write the checkpoint: {}; check space and permissions",
                                  path.string(), error.what()));
    }
}

Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain) {
    initialize();
    if (!std::filesystem::exists(path))
        throw FileError(fmt::format("{}: there is no checkpoint; run without --resume", path.string()));
    Checkpoint checkpoint{{domain, {}}, {}};
    try {
        openvdb::io::File file(path.string());
        file.open(false);  // no delayed loading: the file will be replaced
        const openvdb::MetaMap::Ptr meta = file.getMetadata();
        checkpoint.text = meta->metaValue<std::string>(kText);
        if (meta->metaValue<std::string>("domain") != domain_text(domain))
            throw FileError("it belongs to another domain or grid spacing");
        const openvdb::GridPtrVecPtr grids = file.getGrids();
        for (std::size_t k = 0; k < grids->size(); ++k)
            for (const auto& grid : *grids)
                if (grid->getName() == fmt::format("layer_{}", k))
                    checkpoint.stack.layers.push_back(
                        {grid->metaValue<std::int32_t>(kMaterial), openvdb::gridPtrCast<Grid>(grid)});
        if (checkpoint.stack.layers.empty() || checkpoint.stack.layers.size() != grids->size())
            throw FileError("it does not hold a stack of layers");
    } catch (const std::exception& error) {
        throw FileError(fmt::format("{}: not a usable checkpoint: {}; run without --resume", path.string(),
                                    error.what()));
    }
    return checkpoint;
}

}  // namespace sidewall::levelset
