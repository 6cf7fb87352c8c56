#include "app/workbench/workbench_page.hpp"

#include <fmt/format.h>

#include "app/report/assets.hpp"
#include "app/report/embed.hpp"

SIDEWALL_EMBED(codemirror_css, SIDEWALL_CODEMIRROR_CODEMIRROR_CSS);
SIDEWALL_EMBED(hint_css, SIDEWALL_CODEMIRROR_SHOW_HINT_CSS);
SIDEWALL_EMBED(codemirror, SIDEWALL_CODEMIRROR_CODEMIRROR_JS);
SIDEWALL_EMBED(hint, SIDEWALL_CODEMIRROR_SHOW_HINT_JS);
SIDEWALL_EMBED(toml, SIDEWALL_CODEMIRROR_TOML_JS);
SIDEWALL_EMBED(workbench_css, SIDEWALL_WORKBENCH_DIR "/workbench.css");
SIDEWALL_EMBED(editor, SIDEWALL_WORKBENCH_DIR "/editor.js");
SIDEWALL_EMBED(compare, SIDEWALL_WORKBENCH_DIR "/compare.js");
SIDEWALL_EMBED(masks, SIDEWALL_WORKBENCH_DIR "/masks.js");
SIDEWALL_EMBED(workbench, SIDEWALL_WORKBENCH_DIR "/workbench.js");

namespace sidewall::app {
namespace {

// The notice of CodeMirror, under the MIT License; the page has its text above three.js.
constexpr std::string_view kEditorLicence =
    "/*! CodeMirror 5, https://codemirror.net, under the MIT License (its text: above three.js): Copyright (C) 2017 by Marijn "
    "Haverbeke and others */";

}  // namespace

std::string workbench_html() {
    const std::string style =
        fmt::format("{}{}{}", embedded_codemirror_css, embedded_hint_css, embedded_workbench_css);
    return page_html("Sidewall", "{}",
                     {.style = style,
                      .policy = "; connect-src 'self'; form-action 'none'; base-uri 'none'",
                      .scripts = {kEditorLicence, embedded_codemirror, embedded_hint, embedded_toml,
                                  embedded_editor, embedded_compare, embedded_masks, embedded_workbench}});
}

}  // namespace sidewall::app
