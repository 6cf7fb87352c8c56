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

// Its licence, the MIT License, is the one whose text stands above three.js in the page.
constexpr std::string_view kEditorLicence =
    "/*! CodeMirror 5, https://codemirror.net, under the MIT License (its text: above three.js): Copyright (C) 2017 by Marijn "
    "Haverbeke and others */";

}  // namespace

std::string workbench_html() {
    const std::string style =
        fmt::format("{}{}{}", embedded(sidewall_codemirror_css, sidewall_codemirror_css_end),
                    embedded(sidewall_hint_css, sidewall_hint_css_end),
                    embedded(sidewall_workbench_css, sidewall_workbench_css_end));
    return page_html(
        "Sidewall", "{}",
        {.style = style,
         .policy = "; connect-src 'self'; form-action 'none'; base-uri 'none'",
         .scripts = {kEditorLicence, embedded(sidewall_codemirror, sidewall_codemirror_end),
                     embedded(sidewall_hint, sidewall_hint_end), embedded(sidewall_toml, sidewall_toml_end),
                     embedded(sidewall_editor, sidewall_editor_end),
                     embedded(sidewall_compare, sidewall_compare_end),
                     embedded(sidewall_masks, sidewall_masks_end),
                     embedded(sidewall_workbench, sidewall_workbench_end)}});
}

}  // namespace sidewall::app
