#!/usr/bin/env bash
# Checks the guide against the program and against itself:
#   docs_test.sh links                           every link of every page has a target; gallery and version are up to date
#   docs_test.sh commands BUILD_DIR SCRATCH      every command in a block marked sh runs, every part of a recipe in one marked
#                                                toml is accepted; page after page in one folder that holds configs and the run that ./setup.sh run leaves
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source=$PWD
pages=(README.md CONTRIBUTING.md docs/*.md)

# The blocks of a page in a language; a line of \x01 after each.
blocks() { awk -v start="\`\`\`$2" '$0 == start { on = 1; next } /^```/ { if (on) print "\001"; on = 0 } on' "$1"; }

# The anchors of a page's headings, as forges make them.
anchors() {
    awk '/^```/ { code = !code } !code && /^#+ / { sub(/^#+ /, ""); print tolower($0) }' "$1" |
        sed -E 's/\[([^]]*)\]\([^)]*\)/\1/g; s/[^a-z0-9 _-]//g; s/ /-/g'
}

# Targets of links and pictures outside of code.
links() {
    awk '/^```/ { code = !code } !code && !/^    /' "$1" | sed -E 's/`[^`]*`//g' |
        { grep -oE '\]\([^)]+\)' || true; } | sed -E 's/^\]\(//; s/\)$//'
}

test_links() {
    local bad=0 page link file anchor size
    for page in "${pages[@]}"; do
        while read -r link; do
            case $link in http://* | https://*) continue ;; esac
            file=${link%%#*} anchor=
            [[ $link == *#* ]] && anchor=${link#*#}
            if [ -n "$file" ]; then file=$(dirname "$page")/$file; else file=$page; fi
            [ -e "$file" ] || { echo "$page: $link leads nowhere"; bad=1; continue; }
            [ -z "$anchor" ] || anchors "$file" | grep -xF -- "$anchor" >/dev/null || { echo "$page: $link: no such heading"; bad=1; }
        done < <(links "$page")
    done
    for page in docs/*.md; do
        [ "$page" = docs/README.md ] || links docs/README.md | grep -xF "$(basename "$page")" >/dev/null ||
            { echo "docs/README.md does not list $page"; bad=1; }
    done
    while read -r size page; do
        [ "$size" -lt 100000 ] || { echo "$page has $size bytes, 100,000 or more"; bad=1; }
    done < <(find docs -type f -printf '%s %p\n')
    docs/make_gallery.sh --check || bad=1
    local version
    version=$(sed -n 's/^project(sidewall VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
    grep -qx "version: $version" CITATION.cff || { echo "CITATION.cff is of another version than $version"; bad=1; }
    [ "$(grep -m 1 '^## [0-9]' CHANGELOG.md)" = "## $version" ] || { echo "CHANGELOG.md does not begin with $version"; bad=1; }
    return $bad
}

# Completes a part of a recipe to a whole one.
complete() {
    local text=$1
    grep -q '^\[domain\]' <<<"$text" || printf '[domain]\nextent = [4.0, 2.0]\ngrid_spacing = 0.1\n'
    printf '%s\n' "$text"
    grep -qE '^\[\[layer\]\]|^\[start\]' <<<"$text" || printf '[[layer]]\nmaterial = "Si"\n'
    grep -q '^\[\[step\]\]' <<<"$text" || printf '[[step]]\nmodel = "isotropic"\nduration = 0.1\nrate = { Si = -0.1 }\n'
}

test_commands() {
    local build=$1 scratch=$2 page name text count=0 recipes=0
    export PATH=$build:$PATH
    [ "$(command -v sidewall)" = "$build/sidewall" ] || { echo "no program in $build"; exit 1; }
    rm -rf "$scratch"
    mkdir -p "$scratch"
    cp -r "$source/configs" "$scratch/"
    cd "$scratch"
    sidewall run configs/trench_deposition.toml --set 'step[0].duration=0.1' --quiet -o results/trench_deposition
    for page in "${pages[@]}"; do
        name=$(tr / _ <<<"${page%.md}")
        while IFS= read -r -d $'\001' text; do
            recipes=$((recipes + 1))
            complete "$text" >"part_$recipes.toml"
            sidewall check "part_$recipes.toml" --no-estimate >check.log 2>&1 ||
                { cat check.log; echo "$page: a block of toml is refused: $text"; exit 1; }
        done < <(blocks "$source/$page" toml)
        blocks "$source/$page" sh | tr -d '\001' >"$name.sh"
        [ -s "$name.sh" ] || continue
        count=$((count + $(grep -cE '^[a-z]' "$name.sh")))
        bash -e -o pipefail -x "$name.sh" >log 2>&1 ||
            { tail -30 log; echo "$page: a command failed: the last one above"; exit 1; }
        echo "$page: ${SECONDS} s"
    done
    # Fewer would mean that the blocks are not found.
    [ $count -ge 30 ] && [ $recipes -ge 12 ] || { echo "only $count commands and $recipes parts of recipes in the guide"; exit 1; }
    rm -rf "$scratch"
    echo "$count commands, $recipes parts of recipes"
}

case "${1:-}" in
    links) test_links ;;
    commands) test_commands "$2" "$3" ;;
    *) sed -n '2,5s/^# //p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
