// Damaged OASIS files, plain and gzipped: oasis_fuzz [SECONDS [SEED]] (mutate.hpp). The reader refuses them
// with a FileError that names the file, or returns finite polygons.
#include "tests/app/recipe/oasis_bytes.hpp"
#include "tests/fuzz/layout_attempt.hpp"

using namespace sidewall;

int main(int argc, char** argv) {
    using test::oas_delta, test::oas_numbers, test::oas_record, test::oas_signed;
    const std::string at = oas_signed(3) + oas_signed(-4);
    const std::string boxes =
        test::oas_rectangle(10, 7, 0, 0, oas_numbers({1, 3, 2, 20, 30})) +
        test::oas_rectangle(10, 7, 9, 9, oas_numbers({10, 1}) + oas_delta(20, 15) + oas_delta(-40, 33)) +
        test::oas_rectangle(10, 7, 9, 9, oas_numbers({5, 1, 5, 3, 7})) +
        oas_record(20, 0xdc, oas_numbers({8, 0}) + at);
    const std::string shapes =
        oas_record(21, 0x3b, oas_numbers({1, 0, 4, 2}) + oas_delta(50, 3) + oas_delta(-20, 30) + at) +
        oas_record(21, 0x3b, oas_numbers({1, 0, 0, 2}) + oas_signed(50) + oas_signed(30) + at) +
        oas_record(22, 0xfb,
                   oas_numbers({1, 0, 5, 11, 9, 4, 2}) + oas_delta(60, 0) + oas_delta(40, 40) + at) +
        oas_record(23, 0x7b, oas_numbers({1, 0, 100, 60}) + oas_signed(13) + oas_signed(-17) + at) +
        oas_record(26, 0xfb, oas_numbers({1, 0, 5, 100, 30}) + at) +
        oas_record(27, 0x3b, oas_numbers({1, 0, 1000}) + at);
    const std::string placed =
        oas_record(17, 0xb0, test::oas_text("A") + at) + oas_numbers({16}) +
        oas_record(18, 0x3f, oas_numbers({0, 2, 0, 90}) + at + oas_numbers({2, 3, 300}));
    const std::string ballast = oas_record(
        28, 0x25, test::oas_text("k") + oas_numbers({10}) + test::oas_text("v") + oas_numbers({4, 1, 3}));
    const std::string plain = test::oas_library(test::oas_cell("A", boxes + shapes + ballast) +
                                                test::oas_cell("TOP", placed)),
                      blocks = test::oas_library(test::oas_block(oas_numbers({13, 0}) + shapes) +
                                                 test::oas_cell("TOP", boxes + placed) + oas_numbers({3}) +
                                                 test::oas_text("A"));
    const std::vector<fuzz::Seed> seeds{{plain}, {blocks}, {test::gzip_of(plain)}};
    const std::vector<std::string> words{boxes,
                                         shapes,
                                         placed,
                                         ballast,
                                         test::oas_block(boxes),
                                         oas_numbers({1, 1U << 30U, 1U << 30U, 1, 1}),
                                         test::oas_cell("B", placed),
                                         oas_numbers({std::uint64_t{1} << 53U}),
                                         oas_numbers({~std::uint64_t{0}}),
                                         oas_numbers({15}),
                                         oas_numbers({16}),
                                         oas_numbers({2})};
    return fuzz::run(argc, argv, seeds, words, [](const std::string& bytes, std::size_t) {
        return fuzz::attempt_layout(bytes, "fuzz.oas", {{1, 0}});
    });
}
