// Damaged tables: csv_fuzz [SECONDS [SEED]] (mutate.hpp). The reader refuses them with a FileError that names
// the file, or returns columns of finite numbers, all of the same length.
#include <cmath>

#include "app/common/text.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/fuzz/mutate.hpp"

using namespace sidewall;
using fuzz::expect;

namespace {

bool attempt(const std::string& bytes) {
    try {
        const app::CsvTable table = app::parse_csv(bytes, "fuzz.csv", 1000);
        expect(!table.columns.empty(), "a table has columns");
        expect(surface::printable(table.understood) == table.understood, "what is said of it can be shown");
        for (const app::CsvColumn& column : table.columns) {
            expect(column.values.size() == table.columns[0].values.size(), "columns are of one length");
            expect(!column.values.empty() && column.values.size() <= 1000,
                   "there are rows, and not too many");
            expect(column.fault.empty() || table.headed, "only a column with a heading may be of texts");
            for (const double value : column.values) expect(std::isfinite(value), "numbers are finite");
        }
        return true;
    } catch (const FileError& error) {
        expect(std::string(error.what()).starts_with("fuzz.csv:"), "an error names the file");
        return false;
    }
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<fuzz::Seed> seeds{
        {"-2,1\n-1,0\n1,0\n2,1\n"},
        {"\xef\xbb\xbfx [nm];z [nm]\r\n-2,5;1\r\n\xe2\x88\x92"
         "1;0\r\n1;0,25 # here\r\n"},
        {"# a comment\nenergy_from,energy_to,angle_from,angle_to,weight\n50,150,0,6,3\n10, 30,0,20,1\n"},
        {"\"n\"\t\"x (um)\"\tz\na\t1\t2\nb\t3\t4\n"},
        {"sep=;\r\nx;z\r\n-1,5;0\r\n1;0,25\r\n"},
        {"1 2 3\r 4 5 6\r7\t8 9\r"}};
    const std::vector<std::string> words{",",   ";",     "\t",           "\"",       "#",   "\n",    "\r",
                                         "nan", "1e999", "[nm]",         "(",        "1,5", "1.5D0", "+-",
                                         " ",   "x",     "\xe2\x88\x92", "\xff\xfe", "sep="};
    return fuzz::run(argc, argv, seeds, words,
                     [](const std::string& bytes, std::size_t) { return attempt(bytes); });
}
