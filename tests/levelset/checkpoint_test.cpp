#include "levelset/layers/checkpoint.hpp"

#include <openvdb/io/File.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <ctime>
#include <fstream>
#include <limits>
#include <random>
#include <string>

#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/folder.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;
using Catch::Matchers::Contains;

namespace {

namespace fs = std::filesystem;

void write_bytes(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

MaterialStack two_layers(const Domain& domain) {
    Shape trench;
    trench.kind = ShapeKind::trench;
    trench.width = 9.0;
    trench.depth = 12.3;
    MaterialStack stack = make_stack(domain, {{3, trench}});
    begin_film(stack, 5);
    return stack;
}

// Checks that the file is refused by name, in printable ASCII.
void check_refused(const fs::path& path, const Domain& domain) {
    try {
        load_checkpoint(path, domain);
        FAIL("read");
    } catch (const FileError& error) {
        const std::string text = error.what();
        CHECK_THAT(text, Contains(path.string() + ": not a usable checkpoint: it is"));
        CHECK(std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; }));
    }
}

}  // namespace

TEST_CASE("a damaged checkpoint is refused by name before anything in it is read", "[foreign]") {
    const test::Folder folder;
    const Domain domain = test::unit_domain(32);
    const fs::path path = folder.path / "checkpoint.vdb";
    save_checkpoint(path, two_layers(domain), "where we were");
    const std::string whole = surface::read_whole_file(path);
    const auto cpu_seconds = [](auto&& work) {
        const std::clock_t start = std::clock();
        work();
        return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    };
    constexpr int kWhole = 50;
    const double reading = cpu_seconds([&] {
        for (int k = 0; k < kWhole; ++k) {
            write_bytes(path, whole);
            load_checkpoint(path, domain);
        }
    });
    double refusing = 0.0;
    int tried = 0;
    const auto refuse = [&](const std::string& bytes) {
        refusing += cpu_seconds([&] {
            write_bytes(path, bytes);
            check_refused(path, domain);
        });
        ++tried;
    };
    // Truncated, mostly near the ends; with bytes appended; with a run of zeros, as after a crash.
    for (std::size_t k = 0; k < 200; ++k) {
        refuse(whole.substr(0, k * whole.size() / 200));
        refuse(whole.substr(0, std::min(k, whole.size())));
        refuse(whole.substr(0, whole.size() - 1 - k));
    }
    refuse(whole + '\0');
    refuse(whole + whole);
    for (std::size_t k = 1; k <= 50; ++k) {
        std::string bytes = whole;
        std::fill_n(bytes.begin() + std::ptrdiff_t(k * whole.size() / 60), whole.size() / 100, '\0');
        if (bytes != whole) refuse(bytes);
    }
    // One bit flipped, sometimes a byte too: in the header, the metadata, the voxels and the seal.
    std::mt19937 random(7);
    for (int k = 0; k < 600; ++k) {
        std::string bytes = whole;
        const std::size_t place = k % 3 == 0   ? random() % 2000
                                  : k % 3 == 1 ? random() % whole.size()
                                               : whole.size() - 1 - random() % 28;
        bytes[place] = static_cast<char>(bytes[place] ^ 1 << random() % 8);
        if (k % 2 == 0) bytes[random() % whole.size()] ^= 0x55;
        if (bytes != whole) refuse(bytes);
    }
    // Refused without being parsed. CPU time on a busy machine is good to a factor of two.
    CHECK(refusing / tried < 2.0 * reading / kWhole);
    write_bytes(path, whole);
    CHECK(load_checkpoint(path, domain).text == "where we were");
}

TEST_CASE("a checkpoint of another version is refused by name") {
    const test::Folder folder;
    const Domain domain = test::unit_domain(16);
    const fs::path path = folder.path / "checkpoint.vdb";
    levelset::write_sealed_file(path, 999, [](std::ostream& out) { out << "what is to come"; });
    CHECK_THROWS_WITH(load_checkpoint(path, domain),
                      Contains(path.string()) && Contains("format version 999"));
    // A plain OpenVDB file, the format of checkpoints without a seal.
    const MaterialStack stack = two_layers(domain);
    openvdb::io::File(path.string()).write(openvdb::GridCPtrVec{stack.layers[0].phi});
    CHECK_THROWS_WITH(load_checkpoint(path, domain), Contains("older than this version"));
    fs::remove(path);
    fs::create_directory(path);
    CHECK_THROWS_WITH(load_checkpoint(path, domain), Contains("it is not a file"));
}

TEST_CASE("a checkpoint whose distances are not numbers is refused") {
    const test::Folder folder;
    const Domain domain = test::unit_domain(16);
    MaterialStack stack = two_layers(domain);
    stack.top().tree().beginLeaf()->buffer().data()[17] = std::numeric_limits<float>::quiet_NaN();
    save_checkpoint(folder.path / "checkpoint.vdb", stack, "");
    CHECK_THROWS_WITH(load_checkpoint(folder.path / "checkpoint.vdb", domain), Contains("not finite"));
}

TEST_CASE("OpenVDB's own programs open a checkpoint") {
    const test::Folder folder;
    const Domain domain = test::unit_domain(16);
    const MaterialStack stack = two_layers(domain);
    save_checkpoint(folder.path / "checkpoint.vdb", stack, "where we were");
    openvdb::io::File file((folder.path / "checkpoint.vdb").string());
    file.open(false);
    const openvdb::GridPtrVecPtr grids = file.getGrids();
    REQUIRE(grids->size() == 2);
    for (const auto& grid : *grids) {
        CHECK(grid->isType<Grid>());
        CHECK(grid->activeVoxelCount() == stack.top().activeVoxelCount());
    }
}
