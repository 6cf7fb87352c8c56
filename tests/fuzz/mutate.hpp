#pragma once
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

// A harness that damages good files at random and hands them to a reader, for a given time:
//   NAME [SECONDS [SEED [ROUND]]]
// Seed and round fix the damaged bytes. Any failure, a sanitizer's report included, ends with the command
// that repeats it; with ROUND only that round is run.
//
// With libFuzzer (SIDEWALL_LIBFUZZER), which keeps inputs that reach new code, a run takes files of one kind:
//   NAME seeds FOLDER [KIND]    writes the good files, to begin with, and their dictionary FOLDER.words
//   NAME fuzz KIND [OPTIONS]    e.g. -max_total_time=900 -rss_limit_mb=2000 -dict=FOLDER.words FOLDER

// Makes a sanitizer's finding end in the handler of SIGABRT below.
extern "C" inline const char* __asan_default_options() {  // NOLINT(bugprone-reserved-identifier)
    return "abort_on_error=1";
}
extern "C" inline const char* __ubsan_default_options() {  // NOLINT(bugprone-reserved-identifier)
    return "abort_on_error=1:print_stacktrace=1";
}

namespace sidewall::fuzz {

using Random = std::mt19937_64;

/// A good file, and its kind: which reader it is for, in a harness with several.
struct Seed {
    std::string bytes;
    std::size_t kind = 0;
};

inline std::uint64_t current_seed = 0, current_round = 0;
inline const char* current_program = "";

inline void say_how_to_repeat() {
    char line[256];
    const int length = std::snprintf(line, sizeof line, "repeat with: %s 0 %llu %llu\n", current_program,
                                     static_cast<unsigned long long>(current_seed),
                                     static_cast<unsigned long long>(current_round));
    if (write(STDERR_FILENO, line, static_cast<std::size_t>(length)) < 0) return;
}

/// Aborts with \p promise on stderr unless \p holds.
inline void expect(bool holds, const std::string& promise) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", promise.c_str());
    std::abort();
}

/// Makes one to eight random changes: of bits, bytes, numbers of up to eight bytes; pieces cut out, repeated,
/// moved or taken from \p other; words of \p dictionary.
inline std::string mutate(std::string bytes, const std::string& other,
                          const std::vector<std::string>& dictionary, Random& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    for (std::size_t left = 1 + below(8); left > 0 && !bytes.empty(); --left) {
        // Half of the changes hit the first 512 bytes, the header, where a byte has most effect.
        const std::size_t head = std::min<std::size_t>(bytes.size(), 512);
        const std::size_t at = below(random() % 2 == 0 ? head : bytes.size());
        const std::size_t length =
            1 + below(std::min<std::size_t>(bytes.size() - at, random() % 4 == 0 ? 4096 : 16));
        const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        switch (random() % 11) {
            case 0:
                bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
                break;
            case 1:
                bytes[at] = static_cast<char>(random());
                break;
            case 2: {  // a size or a count: zero, huge, negative
                const std::size_t size = std::min<std::size_t>(std::size_t{1} << below(4), bytes.size() - at);
                const char fill = random() % 3 == 0 ? '\0' : random() % 2 == 0 ? '\xff' : '\x7f';
                std::fill_n(place, size, fill);
                break;
            }
            case 3:
                bytes.erase(at, length);
                break;
            case 4:
                bytes.insert(at, bytes.substr(at, length));
                break;
            case 5:
                bytes.insert(below(bytes.size()), bytes.substr(at, length));
                break;
            case 6:
                if (!other.empty()) bytes.insert(at, other.substr(below(other.size()), length));
                break;
            case 7:
                if (random() % 8 == 0) bytes.resize(at);
                break;
            case 8:  // a digit of a number
                for (std::size_t k = at; k < bytes.size() && k < at + 200; ++k)
                    if (bytes[k] >= '0' && bytes[k] <= '9') {
                        bytes[k] = static_cast<char>('0' + random() % 10);
                        if (random() % 4 == 0) bytes.insert(k, std::string(1 + below(12), '9'));
                        break;
                    }
                break;
            default:
                if (!dictionary.empty()) {
                    const std::string& word = dictionary[below(dictionary.size())];
                    if (random() % 2 == 0)
                        bytes.insert(at, word);
                    else
                        bytes.replace(at, std::min(word.size(), bytes.size() - at), word);
                }
        }
    }
    return bytes;
}

#ifdef SIDEWALL_LIBFUZZER
extern "C" int LLVMFuzzerRunDriver(int* argc, char*** argv,
                                   int (*callback)(const std::uint8_t* data, std::size_t size));

/// The libFuzzer driver: see the modes "seeds" and "fuzz" on top of this file.
template <class Attempt>
int run(int argc, char** argv, const std::vector<Seed>& seeds, const std::vector<std::string>& dictionary,
        const Attempt& attempt) {
    static const Attempt* const reader = &attempt;
    static std::size_t kind = 0;
    const std::string mode = argc > 2 ? argv[1] : "";
    if (mode == "seeds") {
        const std::filesystem::path folder = argv[2];
        std::filesystem::create_directories(folder);
        for (std::size_t k = 0; k < seeds.size(); ++k)
            if (argc < 4 || seeds[k].kind == std::strtoull(argv[3], nullptr, 10))
                std::ofstream(folder / std::to_string(k), std::ios::binary) << seeds[k].bytes;
        std::ofstream words(folder.string() + ".words");
        for (const std::string& word : dictionary) {
            words << '"';
            for (const char c : word) {
                char code[8];
                std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned char>(c));
                words << code;
            }
            words << "\"\n";
        }
        return words.good() ? 0 : 1;
    }
    if (mode != "fuzz") {
        std::fprintf(stderr, "%s seeds FOLDER [KIND] | %s fuzz KIND [options]\n", argv[0], argv[0]);
        return 2;
    }
    kind = std::strtoull(argv[2], nullptr, 10);
    argv[2] = argv[0];
    argv += 2;
    argc -= 2;
    return LLVMFuzzerRunDriver(&argc, &argv, [](const std::uint8_t* data, std::size_t size) {
        (*reader)(std::string(reinterpret_cast<const char*>(data), size), kind);
        return 0;
    });
}
#else
/// Runs \p attempt on damaged \p seeds: attempt(bytes, kind of the seed) returns whether the reader accepted
/// them and aborts if it broke a promise. An attempt may take 20 seconds of CPU time, the program 2 GB.
template <class Attempt>
int run(int argc, char** argv, const std::vector<Seed>& seeds, const std::vector<std::string>& dictionary,
        const Attempt& attempt) {
    constexpr double kLongest = 20.0;
    constexpr long kMostKilobytes = 2'000'000;
    current_program = argv[0];
    const double seconds = argc > 1 ? std::atof(argv[1]) : 10.0;
    current_seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    const bool one = argc > 3;
    for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE})
        if (number == SIGABRT || seconds >= 0.0) {
            struct sigaction action {};
            action.sa_handler = [](int caught) {
                say_how_to_repeat();
                signal(caught, SIG_DFL);
                raise(caught);
            };
            // Leaves the address sanitizer's own handlers, which report more and end in SIGABRT.
            struct sigaction before {};
            sigaction(number, nullptr, &before);
            if (number == SIGABRT || before.sa_handler == SIG_DFL) sigaction(number, &action, nullptr);
        }
    using Clock = std::chrono::steady_clock;
    const auto since = [](Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    const auto start = Clock::now();
    std::uint64_t rounds = 0, taken = 0;
    double longest = 0.0;
    for (std::uint64_t round = one ? std::strtoull(argv[3], nullptr, 10) : 0;
         one ? rounds < 1 : since(start) < seconds; ++round, ++rounds) {
        current_round = round;
        std::seed_seq key{current_seed, round};
        Random random(key);
        const std::size_t chosen = random() % seeds.size();
        const std::string bytes =
            mutate(seeds[chosen].bytes, seeds[random() % seeds.size()].bytes, dictionary, random);
        const std::clock_t begin = std::clock();
        taken += attempt(bytes, seeds[chosen].kind) ? 1 : 0;
        longest = std::max(longest, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
        expect(longest < kLongest, "a file is read or refused within 20 seconds of the processor");
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        expect(usage.ru_maxrss < kMostKilobytes, "a small file is read or refused in 2 GB");
    }
    std::printf("%llu damaged files, %llu of them readable, %.3g s the longest: nothing found\n",
                static_cast<unsigned long long>(rounds), static_cast<unsigned long long>(taken), longest);
    return 0;
}
#endif

}  // namespace sidewall::fuzz
