#include "app/report/report.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/report/parts.hpp"
#include "app/report/view.hpp"
#include "app/report/view_mesh.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/topology.hpp"
#include "tests/app/report/page_data.hpp"
#include "tests/app/report/result_folder.hpp"

using namespace sidewall;
using namespace sidewall::app;
using sidewall::test::Folder, sidewall::test::data_of, sidewall::test::data_text, sidewall::test::section,
    sidewall::test::write;

namespace {

const std::string kHostile = "</script><script>alert(1)</script><!-- \" & '";

const std::string kTimeline =
    "step,name,time [s],dt [s],max_speed [um/s],raw_vertices,raw_triangles,simplified_vertices,simplified_triangles,"
    "segments,leaked,relative_error,depth [um]\n"
    "1,\"1 etch, slow\",0,2.5,1,8,8,4,4,9,0,0.01,1\n1,\"1 etch, slow\",2.5,2.5,1,8,8,4,4,9,0,0.02,0.9\n";

std::string bytes_of(const std::string& base64_text) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : base64_text) {
        if (c == '=') break;
        bits = bits << 6 | static_cast<std::uint32_t>(letters.find(c));
        if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255u);
    }
    return bytes;
}

unsigned word(const std::string& bytes, std::size_t at) {
    return static_cast<unsigned char>(bytes[2 * at]) + 256u * static_cast<unsigned char>(bytes[2 * at + 1]);
}

// Decodes a mesh as the page's script does.
TriangleMesh decoded(const Json& mesh, const Json& view) {
    TriangleMesh result;
    const std::string p = bytes_of(mesh["p"].get<std::string>()), i = bytes_of(mesh["i"].get<std::string>());
    for (std::size_t v = 0; v < mesh["n"].get<std::size_t>(); ++v) {
        Vec3 point;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = view["min"][std::size_t(axis)], high = view["max"][std::size_t(axis)];
            point[axis] = low + word(p, 3 * v + std::size_t(axis)) / 65535.0 * (high - low);
        }
        result.vertices.push_back(point);
    }
    for (std::size_t t = 0; t < i.size() / 6; ++t)
        result.triangles.push_back({word(i, 3 * t), word(i, 3 * t + 1), word(i, 3 * t + 2)});
    return result;
}

std::size_t count(const std::string& text, const std::string& word) {
    std::size_t number = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++number;
    return number;
}

// A wavy surface over [-1, 1]^2, `n` cells wide.
TriangleMesh waves(std::uint32_t n) {
    TriangleMesh mesh;
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double x = 2.0 * i / n - 1.0, y = 2.0 * j / n - 1.0;
            mesh.vertices.emplace_back(x, y, 0.1 * std::sin(3.0 * x) * std::cos(3.0 * y));
        }
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i;
            mesh.triangles.push_back({a, a + 1, a + n + 2});
            mesh.triangles.push_back({a, a + n + 2, a + n + 1});
        }
    mesh.triangle_attributes.push_back(
        {"material", 1, Scalar::int32, std::vector<double>(mesh.triangles.size(), 0)});
    Attribute height{"rate", 1, Scalar::float64, {}};
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        height.values.push_back(triangle_centroid(mesh, t).x());
    mesh.triangle_attributes.push_back(std::move(height));
    return mesh;
}

}  // namespace

TEST_CASE("base 64 is that of RFC 4648") {
    CHECK(base64("").empty());
    CHECK(base64("f") == "Zg==");
    CHECK(base64("fo") == "Zm8=");
    CHECK(base64("foobar") == "Zm9vYmFy");
    CHECK(base64(std::string("\xff\x00\xfe", 3)) == "/wD+");
}

TEST_CASE("a page of results is one file that names no address and may load nothing") {
    const Folder folder;
    test::write_result_folder(folder.path);
    write(folder.path / "timeline.csv", kTimeline);
    const Report report = make_report(folder.path);
    CHECK(report.kind == "run");
    CHECK(report.surfaces == 2);
    CHECK(report.html.size() < kMostPageBytes);
    CHECK(report.html.starts_with("<!doctype html>"));
    CHECK(count(report.html, "default-src 'none'") == 1);
    // In three.js: XML's namespace, a paper in a comment, its licence, its controls' authors.
    const std::size_t known = count(report.html, "http://www.w3.org/1999/xhtml") +
                              count(report.html, "https://graphics.stanford.edu/papers/envmap/envmap.pdf") +
                              count(report.html, "three.js r111, https://threejs.org") +
                              count(report.html, "\t * @author ");
    CHECK(count(report.html, "http:") + count(report.html, "https:") == known);
    CHECK(count(report.html, "@import") == 0);
    CHECK(count(report.html, " src=") == 0);
    CHECK(count(report.html, "url(") == 0);
}

TEST_CASE("what stands in recipes and names is text on a page, not markup") {
    const Folder folder;
    const auto run = folder.path / "a<b>&c";
    std::filesystem::create_directory(run);
    test::write_result_folder(run);
    write(run / "recipe.toml", "# " + kHostile + "\n");
    write(run / "timeline.csv", "step,name,time [s]\n1,\"" + std::string("</script>") + "\",0\n");
    const std::string html = make_report(run).html;
    CHECK(html.find("<title>run: a&lt;b&gt;&amp;c</title>") != std::string::npos);
    CHECK(html.find("alert(1)</script>") == std::string::npos);
    CHECK(data_text(html).find('<') == std::string::npos);
    CHECK(section(data_of(html), "recipe")["effective"] == "# " + kHostile + "\n");
    CHECK(data_of(html)["title"] == "a<b>&c");
}

TEST_CASE("a page shows saved surfaces to half a step of its 16 bits, with materials by layer") {
    const Folder folder;
    test::write_result_folder(folder.path);
    const Json data = data_of(make_report(folder.path).html);
    const Json& view = section(data, "view");
    REQUIRE(view["frames"].size() == 2);
    CHECK(view["frames"][1]["label"] == "t = 5 s");
    const TriangleMesh shown = decoded(view["frames"][1]["surface"], view), saved = test::trench_surface();
    CHECK(shown.triangles.size() == saved.triangles.size());
    const double half_step = 2.0 / 65535.0 / 2.0;
    CHECK(surface::two_sided_distance(saved, shown).max <= std::sqrt(3.0) * half_step);
    // SiO2 over Si: the section's uppermost layer, and the boundary of the one below it.
    CHECK(view["frames"][1]["top"] == 1);
    REQUIRE(view["frames"][1]["layers"].size() == 1);
    CHECK(view["frames"][1]["layers"][0][1] == 0);
    CHECK(view["materials"].size() == 2);
    CHECK(view["attributes"].size() == 2);
    // The profile at y = 0 has the trench's six corners alone.
    const Json& profile = section(data, "charts")["charts"][0];
    CHECK(profile["x"] == "x [\u00b5m]");
    CHECK(profile["series"][1]["points"].size() == 6);
}

TEST_CASE("curves on a page are the timeline's, ended by the summary's value") {
    const Folder folder;
    test::write_result_folder(folder.path);
    write(folder.path / "timeline.csv", kTimeline);
    write(folder.path / "summary.json",
          R"({"version": "0.2.0", "recipe": "t.toml", "time": 5.0, "timing": {"trace": 3.0, "total": 4.0},
              "metrology": {"depth": 0.8}, "metrology_units": {"depth": "um"}})");
    const Json data = data_of(make_report(folder.path).html);
    const Json* measures = nullptr;
    for (const Json& one : data["sections"])
        if (one["title"] == "Measures over time") measures = &one;
    REQUIRE(measures);
    const Json& depth = (*measures)["charts"][0];
    CHECK(depth["y"] == "depth [\u00b5m]");
    CHECK(depth["series"][0]["points"] == Json::parse("[[0,1],[2.5,0.9],[5.0,0.8]]"));
    CHECK(section(data, "bars")["rows"] == Json::parse(R"([["trace", 3.0], ["other", 1.0]])"));
    CHECK(data["notes"].empty());
}

TEST_CASE("surfaces too big for a page are coarsened within the bound that it states") {
    const Folder folder;
    const surface::MeshMetadata metadata{{{"length_unit", "um"}, {"time_unit", "s"}}, {{"time", 0.0}}};
    const TriangleMesh saved = waves(80);
    surface::write_mesh(folder.path / "surface_0000.vtp", saved, metadata);
    write(folder.path / "surface.pvd",
          "<VTKFile><Collection>\n<DataSet timestep=\"0\" part=\"0\" "
          "file=\"surface_0000.vtp\"/>\n</Collection></VTKFile>\n");
    const auto frames = [&] {
        return std::vector<ViewFrame>{{"t", folder.path, saved_surfaces(folder.path)[0]}};
    };
    const View whole = make_view(frames(), {{}}, 1'000'000), small = make_view(frames(), {{}}, 60'000);
    CHECK(whole.section["note"] == "Surfaces are shown as saved.");
    const TriangleMesh coarse = decoded(small.section["frames"][0]["surface"], small.section);
    CHECK(coarse.triangles.size() < saved.triangles.size() / 3);
    CHECK(small.section.dump().size() < 60'000);
    const std::string note = small.section["note"];
    const double cells = std::stod(note.substr(note.find('(') + 1)), cell = 2.0 / 80;
    // The cell size is taken from the mean triangle, which slopes and diagonals change by a few percent.
    CHECK(surface::two_sided_distance(saved, coarse).max <= 1.1 * cells * cell + 1e-4);
    // Sections are cut before the mesh is simplified.
    CHECK(whole.profiles == small.profiles);
}

TEST_CASE("parts that touch along an edge come apart and folds cancel, so that both can be simplified") {
    // Two tetrahedra with a common edge 0-1, and a triangle that lies there twice, back to back.
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}, {0, 1, 4},
                      {0, 4, 5}, {0, 5, 1}, {1, 5, 4}, {1, 2, 4}, {4, 2, 1}};
    CHECK_FALSE(surface::analyse_topology(mesh).manifold());
    const TriangleMesh parts = manifold_parts(mesh);
    const surface::Topology topology = surface::analyse_topology(parts);
    CHECK(parts.triangles.size() == 8);
    CHECK(parts.vertices.size() > mesh.vertices.size());
    CHECK(topology.manifold());
    for (std::size_t t = 0; t < parts.triangles.size(); ++t)
        CHECK(triangle_centroid(parts, t) == triangle_centroid(mesh, t));
}

TEST_CASE("a page of an unfinished run tells so and shows what is there") {
    const Folder folder;
    test::write_result_folder(folder.path);
    std::filesystem::remove(folder.path / "summary.json");
    write(folder.path / "timeline.csv", kTimeline + "1,half a r");  // killed while it wrote
    const Json data = data_of(make_report(folder.path).html);
    REQUIRE(data["notes"].size() == 1);
    CHECK(data["notes"][0] == "This run has not ended: the page shows its results so far.");
    CHECK(section(data, "view")["frames"].size() == 2);
}

TEST_CASE("folders without results and damaged ones are refused by name", "[foreign]") {
    const Folder folder;
    const auto refused = [&](const std::string& part) {
        CHECK_THROWS_AS(make_report(folder.path), FileError);
        CHECK_THROWS_WITH(make_report(folder.path), Catch::Contains(part));
    };
    refused("holds no results");
    CHECK_THROWS_WITH(make_report(folder.path / "none"), Catch::Contains("no such folder"));
    write(folder.path / "a", "");
    CHECK_THROWS_WITH(make_report(folder.path / "a"), Catch::Contains("is a file"));
    for (const char* name : {"study.json", "compare.json", "fit.json", "sweep.json"}) {
        write(folder.path / name, "{\"variants\": [");
        refused("is no JSON");
        std::filesystem::remove(folder.path / name);
    }
    write(folder.path / "compare.json", R"({"variants": 3})");
    refused("is not what this program writes");
    std::filesystem::remove(folder.path / "compare.json");
    for (const char* fit :
         {R"({"parameters": {"a": {}}})",
          R"({"parameters": {"a": {"value": 1, "interval95": [0, 1]}}, "residuals": {"q": {}}})"}) {
        write(folder.path / "fit.json", fit);
        refused("is not what this program writes");
        std::filesystem::remove(folder.path / "fit.json");
    }
    write(folder.path / "sweep.json", R"({"vary": ["a=1"], "rows": 2})");
    write(folder.path / "sweep.csv", "run,a,status\n0001,1\n0002,1,ok\n");
    refused("row 1 has 2 values under 3 names");
    std::filesystem::remove(folder.path / "sweep.json");
    test::write_result_folder(folder.path);
    write(folder.path / "surface_0001.vtp", "<VTKFile");
    refused("surface_0001.vtp");
}
