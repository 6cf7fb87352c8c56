#include "app/pictures/render.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/pictures/film_strip.hpp"
#include "app/pictures/render_scene.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "tests/app/report/result_folder.hpp"

namespace sidewall::app {
void add_render_command(CLI::App& program);  // app/commands/render.cpp
}

using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

Result trench_result() {
    Result result;
    result.source = "trench.vtp";
    result.surface = test::trench_surface();
    result.interfaces.push_back(test::trench_interface());
    return result;
}

void command(const std::string& arguments) {
    CLI::App program;
    add_render_command(program);
    program.parse("render " + arguments);
}

double redness(const Colour& c) {
    return c.x() / c.z();
}

}  // namespace

TEST_CASE("a point is in the lowest layer that wraps it, or in the open") {
    const Result result = trench_result();
    const RenderScene scene(result, choose_colouring(result, "", {}));
    REQUIRE(scene.solid());
    const Colour silicon = colour_from_hex(default_materials()[0].colour),
                 oxide = colour_from_hex(default_materials()[1].colour);
    SectionReader sections(scene);
    for (const double y : {-0.93, 0.07, 0.51}) {
        const auto colour = [&](double x, double z) {
            const SectionSample sample = sections.at({x, y, z}, 1, 1e-3);
            CHECK(sample.solid == 1.0);
            return sample.colour;
        };
        CHECK(colour(-0.8, -0.5) == silicon);
        CHECK(colour(0.1, -1.5) == silicon);
        CHECK(colour(-0.8, 0.1) == oxide);
        CHECK(colour(0.41, -0.5) == oxide);
        CHECK(colour(0.1, -0.9) == oxide);
        CHECK(sections.at({0.1, y, -0.5}, 1, 1e-3).solid == 0.0);
        CHECK(sections.at({-0.8, y, 0.3}, 1, 1e-3).solid == 0.0);
    }
    const auto entries = legend(materials_on(result), materials_of(result.metadata));
    REQUIRE(entries.size() == 2);
    CHECK(entries[0].name == "Si");
    CHECK(entries[1].name == "SiO2");
}

namespace {

/// Flat layers over [-1, 1]^2 whose tops lie at the given heights; material k is the k-th of the table.
Result flat_layers(const std::vector<double>& tops) {
    Result result;
    for (std::size_t k = 0; k < tops.size(); ++k)
        result.interfaces.push_back(test::profile_mesh({{-1, tops[k]}, {1, tops[k]}}, double(k)));
    result.surface = result.interfaces.back();
    result.interfaces.pop_back();
    return result;
}

}  // namespace

TEST_CASE("a film much thinner than a pixel has its share of the pixels, and only its own colour") {
    // Silicon, then a film of SiO2 of a tenth of a pixel, then nitride: three colours that span all mixtures.
    const double pixel = 0.2, film = 0.1 * pixel;
    const Result result = flat_layers({0.0, film, 0.6});
    const RenderScene scene(result, {});
    REQUIRE(scene.thin() < film);
    SectionReader sections(scene);
    const Colour silicon = colour_from_hex(default_materials()[0].colour),
                 oxide = colour_from_hex(default_materials()[1].colour),
                 nitride = colour_from_hex(default_materials()[2].colour);
    Eigen::Matrix3d basis;
    basis << silicon, oxide, nitride;
    // Wherever the pixels lie, the film's shares of them add up to its thickness.
    for (const double offset : {0.0, 0.03, 0.11, 0.17}) {
        Vec3 sum = Vec3::Zero();
        for (int row = -3; row < 5; ++row) {
            const SectionSample sample = sections.at({0.1, 0.2, (row + 0.5) * pixel + offset}, 1, pixel);
            const Vec3 shares = basis.inverse() * sample.colour * sample.solid;
            CHECK(shares.minCoeff() > -1e-9);
            sum += pixel * shares;
        }
        CHECK(sum[0] == Approx(3.0 * pixel - offset).epsilon(1e-6));
        CHECK(sum[1] == Approx(film).epsilon(1e-6));
        CHECK(sum[2] == Approx(0.6 - film).epsilon(1e-6));
    }
}

TEST_CASE("where two interfaces coincide the layer between them is not painted") {
    Result result = flat_layers({0.0, 0.0, 0.5});
    // The two interfaces differ by ripples of 1e-3 only.
    for (Vec3& p : result.interfaces[1].vertices) p.z() += 1e-3 * std::sin(40.0 * p.x() * p.y());
    const RenderScene scene(result, {});
    const Colour silicon = colour_from_hex(default_materials()[0].colour),
                 nitride = colour_from_hex(default_materials()[2].colour);
    SectionReader sections(scene);
    for (int i = -200; i < 200; ++i) {
        const double z = 1e-4 * (i + 0.5);
        CAPTURE(z);
        const SectionSample sample = sections.at({0.3, -0.4, z}, 1, 1e-6);
        CHECK(((sample.colour - silicon).norm() < 1e-12 || (sample.colour - nitride).norm() < 1e-12));
    }
}

TEST_CASE("a colour bar or legend never covers the geometry") {
    Result result = trench_result();
    RenderOptions options;
    SECTION("a legend") {
        result.metadata.texts = {{"materials", "Si,Unobtainium of a very long name indeed"}};
    }
    SECTION("a bar with a long title and long numbers") {
        options.color = "flux_error_of_a_species_with_a_long_name";
        options.range = {1.234567e-7, 1.2345671e-7};
        result.surface.triangle_attributes.push_back(
            {options.color, 1, Scalar::float64, std::vector<double>(result.surface.triangles.size(), 2.0)});
    }
    options.azimuth_deg = 0.0;
    const Colour ink = colour_from_hex("#2b303a");
    for (const auto& [width, height] : {std::pair{240, 180}, {100, 200}, {240, 64}, {64, 64}}) {
        options.width = width;
        options.height = height;
        Picture picture = render(result, options);
        // From the left: background, the geometry, background again, and only then the legend.
        const auto blank = [&](int x) {
            for (int y = 0; y < height; ++y)
                if (picture.at(x, y) != picture.at(0, y)) return false;
            return true;
        };
        int begin = 0, end = 0, key = width;
        while (begin < width && blank(begin)) ++begin;
        for (end = begin; end < width && !blank(end);) ++end;
        for (int x = width - 1; x >= 0; --x)
            for (int y = 0; y < height; ++y)
                if (picture.at(x, y).isApprox(ink)) key = x;
        CAPTURE(width, height, begin, end, key);
        CHECK(begin > 0);
        CHECK(end > begin);
        CHECK(key >= end);
        CHECK(key < width);
        // The legend ends before the picture does.
        CHECK(blank(width - 1));
    }
}

TEST_CASE("a picture has the same bits on one and on two threads") {
    const Result result = trench_result();
    RenderOptions options;
    options.width = 160;
    options.height = 120;
    options.cut = surface::parse_plane("y=0.1");
    const auto draw = [&](std::size_t threads) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        return render(result, options).pixels;
    };
    CHECK(draw(1) == draw(2));
}

TEST_CASE("a cut shows the material inside, seen from either side", "[slow]") {
    const Result result = trench_result();
    RenderOptions options;
    options.width = 720;
    options.height = 540;
    options.elevation_deg = 0.0;
    // A thin slice, so that perspective shows next to nothing of the trench's walls behind the section.
    const bool from_behind = GENERATE(false, true);
    options.azimuth_deg = from_behind ? 180.0 : 0.0;
    options.cut = surface::parse_plane(from_behind ? "y=-0.95" : "y=0.95");
    Picture picture = render(result, options);
    // Seen straight on, the box spans x from -1 to 1 and z from -1.24 to 0.2 about the middle of the picture
    // left of the legend; the mouth of the trench shows the background, its shoulders silicon, their rim
    // oxide.
    int silicon = 0, oxide = 0, open = 0;
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width * 8 / 10; ++x) {
            const Colour& c = picture.at(x, y);
            // Half silicon, half oxide has a red to blue ratio of 1.7.
            ++(c.y() > 0.6 ? open : redness(c) > 1.7 ? oxide : silicon);
        }
    // Areas of the section: Si 2 x 1.24 less 1 x 1; SiO2 0.2 over 2 x 0.7 plus the liner 2 x 0.2 x 1 plus the
    // floor 0.6 x 0.2. Tolerance: an outline one pixel wide, of 255 pixels a unit of length, along 5 units of
    // edge takes 2.5 % of the oxide and 1.3 % of the silicon.
    const double si = 2 * 1.24 - 1.0, sio2 = 0.2 * 1.4 + 0.4 + 0.12;
    CHECK(double(oxide) / silicon == Approx(sio2 / si).epsilon(0.04));
    CHECK(open > 0);
}

TEST_CASE("colouring takes the attribute of that name, a species' where only the kind is named") {
    Result result = trench_result();
    TriangleMesh& mesh = result.surface;
    mesh.triangle_attributes.push_back(
        {"flux_ion", 1, Scalar::float64, std::vector<double>(mesh.triangles.size(), 2.0)});
    mesh.vertex_attributes.push_back(
        {"rate", 3, Scalar::float64, std::vector<double>(3 * mesh.vertices.size(), 1.0)});
    result.metadata.texts = {{"length_unit", "um"}, {"time_unit", "s"}};
    CHECK_FALSE(choose_colouring(result, "", {}).scalar);
    const Colouring flux = choose_colouring(result, "flux", {});
    CHECK(flux.scalar);
    CHECK(flux.title == "flux_ion");
    CHECK(flux.values == std::vector<double>(mesh.triangles.size(), 2.0));
    const Colouring rate = choose_colouring(result, "rate", std::array{0.0, 4.0});
    CHECK(rate.per_vertex);
    CHECK(rate.title == "rate (\u00b5m/s)");
    CHECK(rate.values[0] == std::sqrt(3.0));
    CHECK(rate.high == 4.0);
    CHECK(choose_colouring(result, "height", {}).low == -0.8);
    CHECK_THROWS_WITH(choose_colouring(result, "fluks", {}),
                      Contains("fluks") && Contains("flux_ion") && Contains("rate"));
    result.surface.triangle_attributes.clear();
    CHECK_THROWS_AS(choose_colouring(result, "material", {}), RecipeError);
}

TEST_CASE("values that are not finite are drawn grey and leave the range alone") {
    Result result = trench_result();
    auto& values =
        result.surface.triangle_attributes.emplace_back(Attribute{"rate", 1, Scalar::float64, {}}).values;
    values.assign(result.surface.triangles.size(), 1.0);
    values[3] = std::nan("");
    values[4] = 1.0 / 0.0;
    values[5] = 3.0;
    const Colouring colouring = choose_colouring(result, "rate", {});
    CHECK(colouring.low == 1.0);
    CHECK(colouring.high == 3.0);
    RenderOptions options;
    options.color = "rate";
    options.width = options.height = 64;
    for (const Colour& c : render(result, options).pixels) REQUIRE(c.allFinite());
}

TEST_CASE("a cut that is oblique or misses is refused") {
    const Result result = trench_result();
    RenderOptions options;
    options.width = options.height = 64;
    options.cut = surface::Plane{Vec3(1, 1, 0), 0.0};
    CHECK_THROWS_AS(render(result, options), RecipeError);
    options.cut = surface::parse_plane("x=3");
    CHECK_THROWS_WITH(render(result, options), Contains("misses the surface, which spans -1"));
}

TEST_CASE("sheets, specks and flat meshes are drawn without NaN") {
    Result result;
    result.source = "odd.vtp";
    result.surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
    result.surface.triangles = {{0, 1, 2}, {0, 3, 1}};
    RenderOptions options;
    options.width = options.height = 64;
    options.edges = true;
    SECTION("a sheet with a triangle of no area") {}
    SECTION("a point") {
        result.surface.triangles = {{0, 3, 0}};
        result.surface.vertices.assign(4, Vec3(1, 1, 1));
    }
    SECTION("from straight above") {
        options.elevation_deg = 90.0;
    }
    for (const Colour& c : render(result, options).pixels) REQUIRE(c.allFinite());
}

TEST_CASE("a strip is one cell wide, also where contact lines put vertices within it") {
    const auto sheet = [](int cells) {  // `cells` across y, 12 along x
        TriangleMesh mesh;
        for (int i = 0; i <= 12; ++i)
            for (int j = 0; j <= cells; ++j) mesh.vertices.emplace_back(i, j, 0.0);
        for (int i = 0; i < 12; ++i)
            for (int j = 0; j < cells; ++j) {
                const auto v = static_cast<std::uint32_t>(i * (cells + 1) + j),
                           w = v + static_cast<std::uint32_t>(cells) + 1;
                mesh.triangles.push_back({v, w, v + 1});
                mesh.triangles.push_back({w, w + 1, v + 1});
            }
        return mesh;
    };
    CHECK(is_strip(sheet(1)));
    CHECK_FALSE(is_strip(sheet(2)));
    TriangleMesh split = sheet(1);
    const std::array<std::uint32_t, 3> last = split.triangles.back();
    split.triangles.back() = {last[0], last[1], 26};
    split.triangles.push_back({last[1], last[2], 26});
    split.triangles.push_back({last[2], last[0], 26});
    split.vertices.emplace_back(11.7, 0.95, 0.0);
    CHECK(is_strip(split));
}

TEST_CASE("the render command writes a PNG of the size asked for, twice the same bytes") {
    const test::Folder folder;
    test::write_result_folder(folder.path);
    const std::string in = folder.path.string(), out = in + "/sub/a.png";
    command(in + " -o " + out + " --color flux --size 96x72 --view -40,20 --cut y=0 --edges");
    const std::string bytes = surface::read_whole_file(out);
    CHECK(bytes.substr(1, 3) == "PNG");
    CHECK(bytes.substr(16, 8) == std::string("\0\0\0\x60\0\0\0\x48", 8));
    command(in + " -o " + in + "/b.png --color flux --size 96x72 --view -40,20 --cut y=0 --edges");
    CHECK(surface::read_whole_file(in + "/b.png") == bytes);
}

TEST_CASE("render draws the saved surface of a time or a number, with its own interfaces") {
    const test::Folder folder;
    test::write_result_folder(folder.path);
    const std::string in = folder.path.string();
    const auto saved = saved_surfaces(folder.path);
    REQUIRE(saved.size() == 2);
    CHECK(saved_at(saved, 2.4).number == 0);
    CHECK(saved_at(saved, 2.6).number == 1);
    CHECK(saved_at(saved, 5.0).number == 1);
    CHECK(saved_number(saved, 0).file.filename() == "surface_0000.vtp");
    for (const double bad : {-1.0, 5.1, 1e300, std::nan(""), 1.0 / 0.0})
        CHECK_THROWS_WITH(saved_at(saved, bad), Contains("--time") && Contains("from time 0 to 5"));
    for (const long long bad : {-1LL, 2LL, 1LL << 40})
        CHECK_THROWS_WITH(saved_number(saved, bad), Contains("--frame") && Contains("0 to 1"));

    const std::string options = " --size 96x72 --cut y=0 -o " + in;
    const auto bytes = [&](const char* name) { return surface::read_whole_file(in + "/" + name); };
    command(in + options + "/last.png");
    command(in + options + "/time.png --time 4.9");
    command(in + options + "/frame.png --frame 1");
    // A surface file alone finds the interface saved beside it.
    command(in + "/surface_0001.vtp" + options + "/file.png");
    CHECK(bytes("time.png") == bytes("last.png"));
    CHECK(bytes("frame.png") == bytes("last.png"));
    CHECK(bytes("file.png") == bytes("last.png"));
    command(in + options + "/first.png --time 0");
    CHECK(bytes("first.png") != bytes("last.png"));
    std::filesystem::rename(in + "/interface_0001_0.vtp", in + "/elsewhere.vtp");
    command(in + "/surface_0001.vtp" + options + "/alone.png");
    CHECK(bytes("alone.png") != bytes("last.png"));
}

TEST_CASE("render --all draws every saved surface in one view and one range, and a strip of them") {
    const test::Folder folder;
    test::write_result_folder(folder.path);
    const std::string in = folder.path.string();
    command(in + " --all -o " + in + "/film --size 96x72 --cut y=0 --color flux");
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(in + "/film"))
        names.insert(entry.path().filename().string());
    CHECK(names ==
          std::set<std::string>{"pictures.txt", "strip.png", "surface_0000.png", "surface_0001.png"});
    // Pictures that pictures.txt names from a longer run are removed; files that it does not name stay.
    const auto write = [&](const std::string& name, const std::string& text) {
        std::ofstream(in + "/film/" + name) << text;
    };
    write("pictures.txt", "strip.png\nsurface_0001.png\nsurface_0002.png\n../recipe.toml\n../away.png\n");
    for (const std::string name : {"surface_0002.png", "surface_0003.png", "../away.png"}) write(name, "old");
    command(in + " --all -o " + in + "/film --size 96x72 --cut y=0 --color flux");
    CHECK_FALSE(std::filesystem::exists(in + "/film/surface_0002.png"));
    CHECK(std::filesystem::exists(in + "/film/surface_0003.png"));
    CHECK(std::filesystem::exists(in + "/away.png"));

    RenderOptions options;
    options.width = options.height = 64;
    options.color = "flux";
    std::vector<std::string> lines;
    render_all(folder.path, options, folder.path / "again",
               [&](const std::string& line) { lines.push_back(line); });
    REQUIRE(lines.size() == 3);
    // The first surface was saved before there were fluxes.
    CHECK_THAT(lines[0], Contains("surface_0000.vtp, time 5 s, without flux_neutral"));
    CHECK_THAT(lines[1], Contains("surface_0001.vtp, time 5 s") && !Contains("without"));
    options.color = "fluks";
    CHECK_THROWS_WITH(render_all(folder.path, options, folder.path / "bad", [](const std::string&) {}),
                      Contains("fluks") && Contains("flux_neutral"));
    CHECK_FALSE(std::filesystem::exists(folder.path / "bad"));

    // One scale serves both pictures: equal points lie at the same place in both.
    const Result first = read_saved(folder.path, saved_surfaces(folder.path)[0]),
                 last = read_result(folder.path);
    PictureScale scale = scale_of(last, {});
    scale.extend(first);
    CHECK(scale.box.min.z() == -1.0);
    CHECK(scale.box.max.z() == 0.2);
    CHECK(scale.materials == std::set<int>{0, 1});
}

TEST_CASE("bad arguments of the render command are usage errors that leave no picture") {
    const test::Folder folder;
    test::write_result_folder(folder.path);
    const std::string in = folder.path.string(), out = " -o " + in + "/a.png";
    for (const std::string bad :
         {" --size 96", " --size 96x0", " --size 1e9x1e9", " --size 96.5x72", " --view 30", " --view 30,99",
          " --view a,b", " --cut w=1", " --cut y=9", " --color nothing", " --range 1,1", " --range 2,1",
          " --range 0,nan", " --time 9", " --time nan", " --frame -1", " --frame 2", " --all"}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(command(in + out + bad), RecipeError);
    }
    CHECK_THROWS_AS(command(in + " -o " + in + "/a.jpg"), RecipeError);
    CHECK_THROWS_AS(command(in + out + " --time 0 --frame 0"), CLI::ParseError);
    for (const std::string of_a_folder : {" --time 0", " --frame 0"})
        CHECK_THROWS_WITH(command(in + "/surface_0001.vtp" + out + of_a_folder), Contains("name the folder"));
    CHECK_THROWS_AS(command(in + "/none.vtp" + out), FileError);
    CHECK_FALSE(std::filesystem::exists(in + "/a.png"));
    CHECK_THROWS_AS(command(in + " --size 64x64 -o " + in + "/summary.json/a.png"), IoError);
}

TEST_CASE("ticks are round, within the range and about as many as wanted") {
    for (const auto& [low, high] :
         {std::pair{0.0, 1.0}, {-3.7, 12.1}, {1e-9, 5e-9}, {0.23, 1.05}, {-2e6, -1e6}}) {
        const Ticks ticks = round_ticks(low, high, 5);
        CAPTURE(low, high, ticks.first, ticks.step, ticks.count);
        CHECK(ticks.count >= 3);
        CHECK(ticks.count <= 7);
        CHECK(ticks.first >= low - 1e-9 * ticks.step);
        CHECK(ticks.first + (ticks.count - 1) * ticks.step <= high + 1e-9 * (high - low));
        CHECK(ticks.first + ticks.count * ticks.step > high);
        const double mantissa = ticks.step / std::pow(10.0, std::floor(std::log10(ticks.step) + 1e-9));
        CHECK((std::abs(mantissa - 1) < 1e-9 || std::abs(mantissa - 2) < 1e-9 ||
               std::abs(mantissa - 2.5) < 1e-9 || std::abs(mantissa - 5) < 1e-9));
    }
    CHECK(round_ticks(2.0, 2.0, 5).count == 1);
    CHECK(round_ticks(std::nan(""), 1.0, 5).count == 0);
}

TEST_CASE("colours survive the way to eight bits, and the map's brightness rises from end to end") {
    for (const char* hex : {"#000000", "#ffffff", "#123456", "#8fa3b8"}) {
        const auto [r, g, b] = to_srgb(colour_from_hex(hex));
        CHECK(fmt::format("#{:02x}{:02x}{:02x}", r, g, b) == hex);
    }
    double last = -1.0;
    for (int i = 0; i <= 50; ++i) {
        const double luminance = viridis(i / 50.0).dot(Vec3(0.2126, 0.7152, 0.0722));
        CHECK(luminance > last);
        last = luminance;
    }
    CHECK(viridis(-1.0) == viridis(0.0));
    CHECK(viridis(std::nan("")).allFinite());
}
