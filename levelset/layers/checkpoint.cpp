#include "levelset/layers/checkpoint.hpp"

#include <fmt/format.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tree/LeafManager.h>

#include <zlib.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <new>
#include <string_view>
#include <vector>

#include "levelset/layers/levels.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::levelset {
namespace {

// The bytes after the content, in this order; numbers are little endian, in memory and in the file.
struct Seal {
    std::array<char, 8> magic{'s', 'i', 'd', 'e', 'w', 'a', 'l', 'l'};
    std::uint64_t content = 0;
    std::uint32_t version = 0, checksum = 0, own = 0;
};
constexpr std::size_t kSealed = offsetof(Seal, own), kSealSize = kSealed + sizeof(Seal::own);
static_assert(std::endian::native == std::endian::little && kSealSize == 28);

std::uint32_t checksum_of(std::string_view bytes, std::uint32_t before = 0) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t checksum_of(const Seal& seal) {
    return checksum_of({reinterpret_cast<const char*>(&seal), kSealed});
}

// Raised with every change of what a checkpoint holds, the caller's text included.
constexpr std::uint32_t kVersion = 1;

constexpr const char* kText = "sidewall";
constexpr const char* kMaterial = "material";
constexpr const char* kColumns = "columns";  // of a level: '1' or '0' by column, where it counts or not
constexpr const char* kMarginEntry = "margin";

std::string domain_text(const Domain& domain) {
    return fmt::format("{} {} {} {} {} {} {} {} {}", domain.min[0], domain.min[1], domain.max[0],
                       domain.max[1], domain.cells[0], domain.cells[1], domain.spacing,
                       static_cast<int>(domain.side[0]), static_cast<int>(domain.side[1]));
}

// Checks the properties on which all code that reads a level set relies. \throws FileError
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

// Name of the grid of layer \p layer on level \p level; the finest level is 0.
std::string grid_name(std::size_t layer, int level) {
    return level == 0 ? fmt::format("layer_{}", layer) : fmt::format("layer_{}_of_level_{}", layer, level);
}

void add_grids(const MaterialStack& stack, int level, openvdb::GridPtrVec& grids) {
    for (std::size_t k = 0; k < stack.layers.size(); ++k) {
        // A copy that shares the tree.
        const GridPtr grid = openvdb::gridPtrCast<Grid>(stack.layers[k].phi->copyGrid());
        grid->setName(grid_name(k, level));
        grid->insertMeta(kMaterial, openvdb::Int32Metadata(stack.layers[k].material));
        grid->removeMeta(kColumns);  // left from a file that the grid was read from
        grid->removeMeta(kMarginEntry);
        if (stack.coarser && k == 0) {
            std::string own;
            for (const std::uint8_t column : stack.columns.own) own += column != 0 ? '1' : '0';
            grid->insertMeta(kColumns, openvdb::StringMetadata(own));
            grid->insertMeta(kMarginEntry, openvdb::Int32Metadata(stack.margin));
        }
        grid->setSaveFloatAsHalf(false);
        grids.push_back(grid);
    }
    if (stack.coarser) add_grids(*stack.coarser, level + 1, grids);
}

// Moves the grids of a level and of all coarser ones out of \p grids.
MaterialStack take_level(const Domain& domain, int level, openvdb::GridPtrVec& grids) {
    MaterialStack stack{domain, {}};
    std::string own;
    for (std::size_t k = 0;; ++k) {
        const auto found = std::find_if(grids.begin(), grids.end(), [&](const auto& grid) {
            return grid->getName() == grid_name(k, level);
        });
        if (found == grids.end()) break;
        stack.layers.push_back(layer_of(*found, domain));
        if (k == 0 && (*found)->template getMetadata<openvdb::StringMetadata>(kColumns)) {
            own = (*found)->template metaValue<std::string>(kColumns);
            stack.margin = (*found)->template metaValue<std::int32_t>(kMarginEntry);
        }
        grids.erase(found);
    }
    if (stack.layers.empty()) throw FileError("it does not hold a stack of layers");
    if (own.empty()) return stack;
    if (most_levels(domain) < 2 || stack.margin < 1 || stack.margin > 2)
        throw FileError("it has levels that its domain cannot have");
    stack.columns = all_columns(domain);
    if (own.size() != stack.columns.own.size()) throw FileError("a level has other columns than its domain");
    for (std::size_t n = 0; n < own.size(); ++n) stack.columns.own[n] = own[n] == '1' ? 1 : 0;
    stack.coarser = std::make_shared<MaterialStack>(take_level(coarser_domain(domain), level + 1, grids));
    if (stack.coarser->layers.size() != stack.layers.size())
        throw FileError("its levels have different layers");
    return stack;
}

}  // namespace

void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text) {
    openvdb::GridPtrVec grids;
    add_grids(stack, 0, grids);
    openvdb::MetaMap meta;
    meta.insertMeta(kText, openvdb::StringMetadata(text));
    meta.insertMeta("domain", openvdb::StringMetadata(domain_text(stack.domain)));
    // OpenVDB's own file writer does not notice a full disk.
    write_sealed_file(path, kVersion,
                      [&](std::ostream& out) { openvdb::io::Stream(out).write(grids, meta); });
}

Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain) {
    initialize();
    if (!std::filesystem::exists(path)) throw FileError("{}: there is no checkpoint", path.string());
    Checkpoint checkpoint{{domain, {}}, {}};
    try {
        std::ifstream in = open_sealed_file(path, kVersion);
        openvdb::io::Stream file(in, false);  // no delayed loading: the file will be replaced
        const openvdb::MetaMap::Ptr meta = file.getMetadata();
        checkpoint.text = meta->metaValue<std::string>(kText);
        if (meta->metaValue<std::string>("domain") != domain_text(domain))
            throw FileError("it belongs to another domain or grid spacing");
        openvdb::GridPtrVec grids = *file.getGrids();
        checkpoint.stack = take_level(domain, 0, grids);
        if (!grids.empty()) throw FileError("it does not hold a stack of layers");
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw FileError("{}: not a usable checkpoint: {}", path.string(), surface::printable(error.what()));
    }
    return checkpoint;
}

void write_sealed_file(const std::filesystem::path& path, std::uint32_t version,
                       const std::function<void(std::ostream& out)>& write) {
    surface::write_file(path, write, [version](std::uint64_t size, std::uint32_t checksum) {
        Seal seal{.content = size, .version = version, .checksum = checksum};
        seal.own = checksum_of(seal);
        return std::string(reinterpret_cast<const char*>(&seal), kSealSize);
    });
}

std::ifstream open_sealed_file(const std::filesystem::path& path, std::uint32_t version) {
    std::error_code failure;
    const auto status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status)) throw FileError("there is no such file");
    if (!std::filesystem::is_regular_file(status)) throw FileError("it is not a file");
    std::ifstream in(path, std::ios::binary);
    const std::streamoff end = in.seekg(0, std::ios::end).tellg();
    if (!in || end < 0) throw FileError("it cannot be read: check its permissions");
    const auto size = static_cast<std::uint64_t>(end);
    if (size < kSealSize) throw FileError("it is cut short");

    Seal seal;
    in.seekg(static_cast<std::streamoff>(size - kSealSize));
    if (!in.read(reinterpret_cast<char*>(&seal), kSealSize))
        throw FileError("it cannot be read: check the disk");
    if (seal.magic != Seal{}.magic)
        throw FileError(
            "it is cut short, or older than this version, whose files of this kind end with a checksum");
    if (seal.own != checksum_of(seal) || seal.content != size - kSealSize)
        throw FileError("it is damaged: its length or its checksum is not what was written");
    if (seal.version != version)
        throw FileError("it is of format version {} and this program reads version {}", seal.version,
                        version);

    in.seekg(0);
    std::vector<char> block(std::size_t{1} << 18);
    std::uint32_t sum = 0;
    for (std::uint64_t left = seal.content; left > 0;) {
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size()));
        if (!in.read(block.data(), static_cast<std::streamsize>(count)))
            throw FileError("it cannot be read: check the disk");
        sum = checksum_of({block.data(), count}, sum);
        left -= count;
    }
    if (sum != seal.checksum) throw FileError("it is damaged: its bytes do not fit their checksum");
    in.seekg(0);
    return in;
}

}  // namespace sidewall::levelset
