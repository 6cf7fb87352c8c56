#include "app/pictures/render.hpp"

#include <cmath>
#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "app/pictures/film_strip.hpp"

namespace sidewall::app {
namespace {

std::array<double, 2> parse_pair(const std::string& option, const std::string& text, char separator,
                                 const char* wanted) {
    const std::vector<std::string> parts = split(text, separator);
    const auto first = finite_number(parts.front()), second = finite_number(parts.back());
    if (parts.size() != 2 || !first || !second)
        throw RecipeError("{} '{}': must be {}", option, text, wanted);
    return {*first, *second};
}

struct RenderArguments {
    std::string input, output, view, cut, size, range;
    WaferChoice choice;
    std::optional<long long> frame;
    bool all = false;
    RenderOptions options;
};

RenderOptions parse(const RenderArguments& arguments) {
    RenderOptions options = arguments.options;
    if (!arguments.view.empty()) {
        const auto [azimuth, elevation] =
            parse_pair("--view", arguments.view, ',', "azimuth,elevation in degrees, such as 25,30");
        if (std::abs(elevation) > 90.0)
            throw RecipeError("--view '{}': elevation must be in [-90, 90]", arguments.view);
        options.azimuth_deg = std::remainder(azimuth, 360.0);
        options.elevation_deg = elevation;
    }
    if (!arguments.size.empty()) {
        const auto [width, height] =
            parse_pair("--size", arguments.size, 'x', "WIDTHxHEIGHT, such as 1200x900");
        if (!(width >= 64 && height >= 64 && width <= 8192 && height <= 8192) || width != std::floor(width) ||
            height != std::floor(height))
            throw RecipeError("--size '{}': must be 64 to 8192 pixels either way", arguments.size);
        options.width = static_cast<int>(width);
        options.height = static_cast<int>(height);
    }
    if (!arguments.cut.empty()) options.cut = surface::parse_plane(arguments.cut);
    if (!arguments.range.empty()) {
        options.range = parse_pair("--range", arguments.range, ',', "LOW,HIGH, such as 0,1");
        if (!((*options.range)[0] < (*options.range)[1]))
            throw RecipeError("--range '{}': LOW must be below HIGH", arguments.range);
    }
    const bool picture = arguments.output.ends_with(".png");
    if (!arguments.all && !picture) throw RecipeError("-o {}: must end in .png", arguments.output);
    if (arguments.all && picture)
        throw RecipeError("-o {}: --all writes many pictures: name a folder", arguments.output);
    return options;
}

/// Reads a mesh file, or of a run's folder the wafer that --step, --time or --frame names (default: the last)
Result read_input(const RenderArguments& arguments) {
    const fs::path input = arguments.input;
    Result result = arguments.frame ? read_saved(input, saved_number(saved_surfaces(input), *arguments.frame))
                                    : read_choice(input, arguments.choice);
    if (!result.folder) result.interfaces = interfaces_beside(input);
    if (arguments.choice.named() || arguments.frame) print_plain("{}\n", name_and_time(result));
    if (const std::string note = unfinished_note(input); !note.empty()) print_plain("{}\n", note);
    return result;
}

// Views a surface that is one cell wide along y (a profile in x and z) from the front.
void show_section(const Result& result, RenderOptions& options) {
    if (is_strip(result.surface)) options.azimuth_deg = options.elevation_deg = 0.0;
}

void draw_one(const RenderArguments& arguments, RenderOptions options) {
    const Result result = read_input(arguments);
    if (arguments.view.empty()) show_section(result, options);
    write_png(arguments.output, render(result, options));
}

void run(const RenderArguments& arguments) {
    RenderOptions options = parse(arguments);
    const bool folder = fs::is_directory(arguments.input);
    if (fs::exists(arguments.input) && !folder && (arguments.all || arguments.frame))
        throw RecipeError("{}: {} chooses among the surfaces of a run: name the folder that `run` wrote",
                          arguments.input, arguments.all ? "--all" : "--frame");
    if (arguments.all && arguments.view.empty()) show_section(read_input(arguments), options);
    if (arguments.all)
        render_all(arguments.input, options, arguments.output, [](const std::string& line) {
            print_plain("{}\n", line);
            std::fflush(stdout);
        });
    else
        draw_one(arguments, options);
}

}  // namespace

void add_render_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand("render", "Draw a surface as a picture; needs no display");
    auto arguments = std::make_shared<RenderArguments>();
    add_option(
        command, "input", arguments->input, "MESH|DIR",
        "Mesh file (VTP, STL, PLY, OBJ), or folder that `run` wrote: its last surface. A surface_NNNN.vtp "
        "is drawn with the interface_NNNN_*.vtp beside it",
        {.required = true});
    add_option(command, "-o,--output", arguments->output, "FILE.png|DIR",
               "Picture to write; with --all the folder for them", {.required = true});
    const auto [step, time] = add_choice_options(command, arguments->choice);
    CLI::Option& frame = add_option(command, "--frame", arguments->frame, "N",
                                    "For a run's folder: surface_NNNN of this number, from 0");
    CLI::Option& all =
        *command.add_flag("--all", arguments->all,
                          "For a run's folder: every saved surface as surface_NNNN.png, all in one view "
                          "and one range of colours, and strip.png with all of them");
    for (CLI::Option* other : {step, time}) other->excludes(&frame)->excludes(&all);
    frame.excludes(&all);
    add_option(command, "--color", arguments->options.color, "NAME",
               "Attribute that colours show: material, flux, rate, distance, height or any other (default: "
               "material if the mesh has it)");
    add_option(
        command, "--view", arguments->view, "AZ,EL",
        "Azimuth and elevation of the viewer in degrees (default: 25,30; for a profile in x and z 0,0, its "
        "section)");
    add_option(command, "--cut", arguments->cut, "AXIS=VALUE",
               "Remove everything in front of a plane, such as y=0");
    add_option(command, "--size", arguments->size, "WxH", "Pixels (default: 1200x900)");
    add_option(command, "--range", arguments->range, "LOW,HIGH",
               "Values at the ends of the colour bar (default: smallest and largest on the surface)");
    command.add_flag("--edges", arguments->options.edges, "Draw the triangles' edges");
    command.callback([arguments] { run(*arguments); });
}

}  // namespace sidewall::app
