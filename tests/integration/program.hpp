#pragma once
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

// Running the program itself, in folders of its own.
namespace sidewall::test {

/// An empty folder, removed with everything in it.
struct Folder {
    std::filesystem::path path;
    Folder() {
        std::string name = (std::filesystem::temp_directory_path() / "sidewall_test_XXXXXX").string();
        REQUIRE(mkdtemp(name.data()) != nullptr);
        path = name;
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

struct Outcome {
    int exit_code = -1;
    std::string output;  ///< standard output and standard error
};

/// Runs `sidewall ARGUMENTS` in \p folder under a time limit, which shows as exit code 124; a crash as 128
/// and more.
inline Outcome run_program(const std::filesystem::path& folder, const std::string& arguments,
                           int seconds = 30) {
    const std::string command = "cd '" + folder.string() + "' && timeout -k 1 " + std::to_string(seconds) +
                                " '" SIDEWALL_PROGRAM "' " + arguments + " 2>&1 </dev/null";
    Outcome outcome;
    FILE* pipe = popen(command.c_str(), "r");
    REQUIRE(pipe != nullptr);
    char buffer[4096];
    for (std::size_t n = 0; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        outcome.output.append(buffer, n);
    const int status = pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    return outcome;
}

inline std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

inline std::string config(const std::string& name) {
    return "'" SIDEWALL_SOURCE_DIR "/configs/" + name + "'";
}

}  // namespace sidewall::test
