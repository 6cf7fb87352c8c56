#include "surface/files/output_file.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::surface;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

int operations = 0, failing = 0;  // the first operation that fails, from 1; 0: none

// Fails the chosen operation and, as on a full disk, all that follow but removals.
int fail_from(const char* operation, const fs::path&) {
    ++operations;
    return failing > 0 && operations >= failing && std::string(operation) != "remove" ? ENOSPC : 0;
}

struct Hook {
    explicit Hook(int first) {
        operations = 0;
        failing = first;
        file_operation_hook = fail_from;
    }
    ~Hook() { file_operation_hook = nullptr; }
};

std::size_t entries(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("whichever operation fails, the file is the old one or the new one, and nothing else is left") {
    const test::Folder folder;
    const fs::path path = folder.path / "file";
    const std::string old(1000, 'a'), fresh(700'000, 'b');
    int first = 1;
    for (bool whole = false; !whole; ++first) {
        REQUIRE(first < 50);
        write_whole_file(path, old);
        const Hook hook(first);
        CAPTURE(first);
        whole = true;
        try {
            write_whole_file(path, fresh);
        } catch (const IoError& error) {
            whole = false;
            CHECK_THAT(error.what(), Contains(path.string() + ": cannot write: No space left on device"));
        }
        const std::string now = read_whole_file(path);
        CHECK((now == fresh || (!whole && now == old)));
        CHECK(entries(folder.path) == 1);
    }
    CHECK(first > 8);  // open, three writes, sync, verify, close, rename, sync of the folder
}

TEST_CASE("a line that does not fit leaves the file as it was") {
    const test::Folder folder;
    const fs::path path = folder.path / "lines.csv";
    append_to_file(path, "one\n");
    append_to_file(path, "two\n");
    for (int first = 1; first <= 3; ++first) {  // open, write, close
        const Hook hook(first);
        CHECK_THROWS_AS(append_to_file(path, "three\n"), IoError);
        CHECK(read_whole_file(path) == "one\ntwo\n");
    }
    for (int first = 1; first <= 4; ++first) {  // open, sync, close, sync of the folder
        const Hook hook(first);
        CAPTURE(first);
        CHECK_THROWS_AS(sync_file(path), IoError);
        CHECK(read_whole_file(path) == "one\ntwo\n");
    }
    CHECK_NOTHROW(sync_file(path));
    CHECK_THROWS_WITH(sync_file(folder.path / "none"), Contains("none: cannot write: No such file"));
}

TEST_CASE("a device is written to, not replaced, and what it refuses is an error") {
    CHECK_THROWS_WITH(write_whole_file("/dev/full", "text"), Contains("/dev/full: cannot write: No space"));
    CHECK(fs::is_character_file("/dev/full"));
    CHECK_NOTHROW(write_whole_file("/dev/null", "text"));
    CHECK(fs::is_character_file("/dev/null"));
    const test::Folder folder;
    fs::create_symlink("/dev/full", folder.path / "flux.csv");
    CHECK_THROWS_AS(write_whole_file(folder.path / "flux.csv", "text"), IoError);
}

TEST_CASE("a link stays and what it names is replaced, and a folder is neither") {
    const test::Folder folder;
    const fs::path target = folder.path / "target", link = folder.path / "link";
    write_whole_file(target, "old");
    fs::create_symlink("target", link);
    write_whole_file(link, "new");
    CHECK(fs::is_symlink(link));
    CHECK(read_whole_file(target) == "new");
    CHECK_THROWS_WITH(write_whole_file(folder.path, "x"), Contains("Is a directory"));
    write_whole_file(folder.path / "a" / "b" / "file", "x");
    CHECK(read_whole_file(folder.path / "a" / "b" / "file") == "x");
    CHECK_THROWS_WITH(write_whole_file(target / "file", "x"), Contains("cannot write: Not a directory"));
}

TEST_CASE("writers of the same file do not meet: it ends as one of theirs") {
    const test::Folder folder;
    const fs::path path = folder.path / "file";
    std::vector<std::thread> writers;
    for (const char letter : {'a', 'b', 'c', 'd'})
        writers.emplace_back([&path, letter] {
            for (int i = 0; i < 20; ++i) write_whole_file(path, std::string(300'000, letter));
        });
    for (std::thread& writer : writers) writer.join();
    const std::string bytes = read_whole_file(path);
    CHECK(bytes == std::string(300'000, bytes[0]));
    CHECK(entries(folder.path) == 1);
}

TEST_CASE("text for a terminal holds characters only") {
    CHECK(printable("caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\n\tend") ==
          "caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\n\tend");
    CHECK(printable(std::string("\0\x1b[31m\x7f\r", 8)) == "\\x00\\x1b[31m\\x7f\\x0d");
    CHECK(printable("\xff\xc3(\xe2\x82") == "\\xff\\xc3(\\xe2\\x82");  // an invalid byte, two cut characters
    CHECK(printable("\xc0\xaf\xed\xa0\x80\xc2\x9b") ==  // an overlong form, a lone surrogate, a control
          "\\xc0\\xaf\\xed\\xa0\\x80\\xc2\\x9b");
}

TEST_CASE("a signal that ends the program while it writes leaves the old file and nothing half written") {
    const test::Folder folder;
    const fs::path path = folder.path / "mesh.vtu";
    write_whole_file(path, "old");
    const std::string block(std::size_t{1} << 20, 'x');
    for (const int ending : {SIGINT, SIGTERM, SIGHUP}) {
        const pid_t child = fork();
        REQUIRE(child >= 0);
        if (child == 0) {
            std::signal(ending, SIG_DFL);  // replaces the test program's own handler
            write_file(path, [&](std::ostream& out) {
                out << block;
                ::raise(ending);
                out << block;
            });
            ::_exit(0);
        }
        int status = 0;
        REQUIRE(::waitpid(child, &status, 0) == child);
        CHECK(WIFSIGNALED(status));
        CHECK(WTERMSIG(status) == ending);
        CHECK(read_whole_file(path) == "old");
        CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
    }
    // Where the program ignores the signal, the file is written to its end.
    const auto before = std::signal(SIGTERM, SIG_IGN);
    write_file(path, [&](std::ostream& out) {
        ::raise(SIGTERM);
        out << block;
    });
    std::signal(SIGTERM, before);
    CHECK(read_whole_file(path) == block);
}
