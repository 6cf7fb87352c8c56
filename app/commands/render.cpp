#include "app/pictures/render.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <memory>

#include "app/commands/commands.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

/// Two numbers with a separator between them.
std::array<double, 2> parse_pair(const std::string& option, const std::string& text, char separator,
                                 const char* wanted) {
    std::array<double, 2> pair{};
    const char *at = text.data(), *end = at + text.size();
    const auto first = std::from_chars(at, end, pair[0]);
    auto second = first;
    if (first.ec == std::errc{} && first.ptr != end && *first.ptr == separator)
        second = std::from_chars(first.ptr + 1, end, pair[1]);
    else
        second.ec = std::errc::invalid_argument;
    if (second.ec != std::errc{} || second.ptr != end || !std::isfinite(pair[0]) || !std::isfinite(pair[1]))
        throw RecipeError(fmt::format("{} '{}': must be {}", option, text, wanted));
    return pair;
}

struct Arguments {
    std::string input, output, view, cut, size, range;
    RenderOptions options;
};

RenderOptions parse(const Arguments& arguments) {
    RenderOptions options = arguments.options;
    if (!arguments.view.empty()) {
        const auto [azimuth, elevation] =
            parse_pair("--view", arguments.view, ',', "azimuth,elevation in degrees, such as 25,30");
        if (std::abs(elevation) > 90.0)
            throw RecipeError(fmt::format("--view '{}': elevation must be in [-90, 90]", arguments.view));
        options.azimuth_deg = std::remainder(azimuth, 360.0);
        options.elevation_deg = elevation;
    }
    if (!arguments.size.empty()) {
        const auto [width, height] =
            parse_pair("--size", arguments.size, 'x', "WIDTHxHEIGHT, such as 1200x900");
        if (!(width >= 64 && height >= 64 && width <= 8192 && height <= 8192) || width != std::floor(width) ||
            height != std::floor(height))
            throw RecipeError(
                fmt::format("--size '{}': must be 64 to 8192 pixels either way", arguments.size));
        options.width = static_cast<int>(width);
        options.height = static_cast<int>(height);
    }
    if (!arguments.cut.empty()) options.cut = surface::parse_plane(arguments.cut);
    if (!arguments.range.empty()) {
        options.range = parse_pair("--range", arguments.range, ',', "LOW,HIGH, such as 0,1");
        if (!((*options.range)[0] < (*options.range)[1]))
            throw RecipeError(fmt::format("--range '{}': LOW must be below HIGH", arguments.range));
    }
    if (!arguments.output.ends_with(".png"))
        throw RecipeError(fmt::format("-o {}: must end in .png", arguments.output));
    return options;
}

}  // namespace

void add_render_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand("render", "Draw a surface as a picture; needs no display");
    auto arguments = std::make_shared<Arguments>();
    command
        ->add_option("input", arguments->input, "Mesh file (VTP, STL, PLY, OBJ) or folder that `run` wrote")
        ->required()
        ->type_name("MESH|DIR");
    command->add_option("-o,--output", arguments->output, "Picture to write")
        ->required()
        ->type_name("FILE.png");
    command
        ->add_option("--color", arguments->options.color,
                     "material, flux, rate, distance, height or any attribute (default: material if there)")
        ->type_name("NAME");
    command
        ->add_option("--view", arguments->view,
                     "Azimuth and elevation of the viewer in degrees (default: 25,30)")
        ->type_name("AZ,EL");
    command->add_option("--cut", arguments->cut, "Take away what lies before a plane, such as y=0")
        ->type_name("AXIS=VALUE");
    command->add_option("--size", arguments->size, "Pixels (default: 1200x900)")->type_name("WxH");
    command->add_option("--range", arguments->range, "Ends of the colour bar (default: the values')")
        ->type_name("LOW,HIGH");
    command->add_flag("--edges", arguments->options.edges, "Draw the triangles' edges");
    command->callback([arguments] {
        const RenderOptions options = parse(*arguments);
        write_png(arguments->output, render(read_result(arguments->input), options));
    });
}

}  // namespace sidewall::app
