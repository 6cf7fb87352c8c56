#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "app/common/text.hpp"
#include "tests/folder.hpp"

// Runs of the program itself, in folders of their own.
namespace sidewall::test {

struct Outcome {
    int exit_code = -1;
    std::string output;  ///< standard output and standard error
};

/// Runs a shell command in \p folder.
inline Outcome run_command(const std::filesystem::path& folder, const std::string& command) {
    Outcome outcome;
    FILE* pipe = popen(("cd '" + folder.string() + "' && " + command).c_str(), "r");
    REQUIRE(pipe != nullptr);
    char buffer[4096];
    for (std::size_t n = 0; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        outcome.output.append(buffer, n);
    const int status = pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    return outcome;
}

/// Runs `sidewall ARGUMENTS` in \p folder under a time limit, which shows as exit code 124; a crash as 128
/// and more.
inline Outcome run_program(const std::filesystem::path& folder, const std::string& arguments,
                           int seconds = 120) {
    return run_command(folder, "timeout -k 1 " + std::to_string(seconds) + " '" SIDEWALL_PROGRAM "' " +
                                   arguments + " 2>&1 </dev/null");
}

/// Runs `sidewall ARGUMENTS` in \p folder with a fault of tests/faults/faults.cpp, under a time limit.
inline Outcome run_with_fault(const std::filesystem::path& folder, const std::string& fault,
                              const std::string& arguments, int seconds = 120) {
    return run_command(folder, "SIDEWALL_FAULT='" + fault + "' timeout -k 1 " + std::to_string(seconds) +
                                   " '" SIDEWALL_FAULTS "' " + arguments + " 2>&1 </dev/null");
}

inline std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

/// Writes recipe.toml, an etch of 0.1 s whose rate at x is that of the table rates.csv beside it.
inline void write_table_recipe(const std::filesystem::path& folder) {
    write_bytes(folder / "recipe.toml", R"toml([domain]
extent = [1.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
[[step]]
model = "formula"
duration = 0.1
rate = "rates(x)"
tables = [{ name = "rates", file = "rates.csv" }]
)toml");
}

/// Process time of the last whole row in a run's timeline. A checkpoint that is due then is written before
/// the row.
inline double last_time(const std::filesystem::path& run) {
    const app::TextTable timeline = app::read_text_table(run / "timeline.csv");
    return std::stod(timeline.rows.back()[timeline.column("time").value()]);
}

/// Number of times that \p part occurs in \p text.
inline std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

inline std::string config(const std::string& name) {
    return "'" SIDEWALL_SOURCE_DIR "/configs/" + name + "'";
}

}  // namespace sidewall::test
