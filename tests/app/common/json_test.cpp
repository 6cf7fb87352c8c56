#include "app/common/json.hpp"

#include <catch2/catch.hpp>

#include "surface/files/file.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE("a file's name that is not UTF-8 does not keep a report from being written") {
    const test::Folder folder;
    const auto path = folder.path / "report.json";
    write_json(path.string(), Json{{"mesh", "part\xff.ply"}});
    CHECK(read_json(path, "")["mesh"] == "part\xef\xbf\xbd.ply");
}
