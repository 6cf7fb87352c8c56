#include "surface/files/locked_folder.hpp"

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <optional>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/output_file.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::surface;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

TEST_CASE("nothing leaves a held folder by a link, and a device or a pipe in it is no file") {
    const test::Folder folder;
    const fs::path out = folder.path / "out", precious = folder.path / "precious";
    fs::create_directory(out);
    write_whole_file(precious, "precious");
    fs::create_symlink("../precious", out / "link");
    fs::create_symlink("../nowhere", out / "dangling");
    REQUIRE(::mkfifo((out / "pipe").c_str(), 0600) == 0);
    {
        const LockedFolder held(out);
        for (const char* name : {"link", "dangling", "pipe"}) {
            CAPTURE(name);
            // Refused however the folder's path is spelt.
            CHECK_THROWS_WITH(write_whole_file(out / name, "x"), Contains("cannot write: is a"));
            CHECK_THROWS_WITH(append_to_file(folder.path / "./out" / name, "x"), Contains("is a"));
            CHECK_THROWS_WITH(sync_file(folder.path / "a/../out" / name), Contains("is a"));
        }
        CHECK(read_whole_file(precious) == "precious");
        CHECK_FALSE(fs::exists(folder.path / "nowhere"));
        write_whole_file(out / "file", "1\n");
        append_to_file(out / "file", "2\n");
        sync_file(out / "file");
        CHECK(read_whole_file(out / "file") == "1\n2\n");
        write_whole_file(folder.path / "beside", "x");  // outside the held folder
    }
    write_whole_file(out / "link", "new");  // the folder is not held any more
    CHECK(read_whole_file(precious) == "new");
}

TEST_CASE("a held folder that is removed, renamed or replaced gets no more files, and none is made again") {
    const int what = GENERATE(0, 1, 2);
    const test::Folder folder;
    const fs::path out = folder.path / "out", moved = folder.path / "moved";
    fs::create_directory(out);
    const LockedFolder held(out);
    write_whole_file(out / "file", "1\n");
    if (what == 0)
        fs::remove_all(out);
    else
        fs::rename(out, moved);
    if (what == 2) fs::create_directory(out);
    CHECK_THROWS_WITH(write_whole_file(out / "file", "x"), Contains("removed, renamed or replaced"));
    CHECK_THROWS_AS(append_to_file(out / "file", "x"), IoError);
    CHECK_THROWS_AS(sync_file(out / "file"), IoError);
    CHECK_FALSE(fs::exists(out / "file"));
    if (what != 0) CHECK(read_whole_file(moved / "file") == "1\n");
    if (what == 1) fs::rename(moved, out);
    if (what == 1) CHECK_NOTHROW(write_whole_file(out / "file", "2\n"));
}

TEST_CASE("of a folder that is held twice the second hold lasts") {
    const test::Folder folder;
    std::optional<LockedFolder> first(folder.path), second(folder.path / "");
    first.reset();
    fs::create_symlink("x", folder.path / "link");
    CHECK_THROWS_AS(write_whole_file(folder.path / "link", "x"), IoError);
    CHECK_THROWS_AS(LockedFolder(folder.path / "none"), IoError);
}
