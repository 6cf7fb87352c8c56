#!/usr/bin/env bash
# Makes docs/gallery.md: runs the recipes of configs/, draws a picture of each, and writes the page from their own comments.
#   docs/make_gallery.sh [NAME...]    all recipes, or these (about 5 minutes for all on 2 idle cores)
#   docs/make_gallery.sh --page       only the page, from the pictures that are there
#   docs/make_gallery.sh --check      runs nothing: fails if the page, a picture or a recipe has changed since
# SIDEWALL names the program (default: build/release/sidewall).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
sidewall=${SIDEWALL:-build/release/sidewall}
pictures=docs/pictures
made=$pictures/made.csv  # recipe, digest of what was run, CPU seconds of that run

# Group, recipe, how its picture is drawn, and `quick` where that is of the quick form. Every recipe of configs/ has a line.
gallery() {
    cat <<'TABLE'
Deposition|trench_deposition|--cut y=0 --view 25,25
Deposition|trench_profile|--view 0,0
Deposition|isotropic_deposition|--cut y=0 --view 25,25
Deposition|hole_deposition|--cut y=0 --view 25,25
Deposition|fin_deposition|--view 25,30
Deposition|pinch_off|--view 15,20
Deposition|teos_trench|--view 25,25
Deposition|teos_two_precursors|--view 25,25
Deposition|ald_hole|--cut y=0 --view 20,15
Deposition|ald_cavity|--view 0,0|quick
Deposition|memory_hole|--view -35,15|quick
Deposition|memory_hole_round|--view 0,0
Deposition|ald_slot|--view 60,10 --color coverage_precursor|quick
Deposition|ald_via|--view 0,0
Deposition|sputter_map|--view 20,20
Deposition|surface_diffusion|--view 20,20
Deposition|neutral_transport|--cut y=0 --view 25,15 --color coverage_theta
Deposition|sputter_deposition|--cut y=0 --view 20,15
Deposition|apcvd_trench|--view 0,0
Deposition|fin_epitaxy|--view 25,20
Etching|simple_hole_etch|--cut y=0 --view 25,20
Etching|directional_hole_etch|--cut y=0 --view 25,25
Etching|deposit_and_etch|--view 25,25
Etching|bosch_hole|--cut y=0 --view 25,20
Etching|bosch_trench|--view 0,0
Etching|sf6o2_hole|--cut y=0 --view 20,15
Etching|fluorocarbon_contact|--cut y=0 --view 20,15
Etching|contact_round|--view 0,0
Etching|chlorine_lines|--view 0,0
Etching|formula_etch|--view 25,20
Etching|sheath_ions|--view 20,20
Etching|oxide_nitride_stack|--view 20,15
Etching|sige_selective_etch|--view 0,0
Etching|slanted_lines|--cut y=0 --view 15,35
Etching|ion_beam_trench|--view 15,20
Etching|faraday_cage|--view 15,20
Etching|blazed_grating|--view 15,20
Etching|sputter_facet|--view 15,25
Etching|wet_etch_pit|--cut y=0 --view 25,35
Etching|cantilever|--view 30,45
Etching|gds_masked_etch|--view 30,40
Sequences|fin_on_wide_wafer|--view 25,25|quick
Sequences|fin_sequence|--view 25,25
Sequences|finfet|--cut y=0 --view 25,30
Sequences|nanowires|--cut y=0 --view 25,25
Sequences|quadruple_patterning|--view 25,35
TABLE
}

# The recipe that a picture is of.
drawn() { if gallery | grep "|$1|.*|quick\$" >/dev/null; then echo "configs/quick/$1.toml"; else echo "configs/$1.toml"; fi; }

# What decides a run: the recipe without the lines that are only comments.
digest() { grep -v '^#' "$(drawn "$1")" | sha256sum | cut -c 1-16; }

# The comment at the top of a recipe, in one line.
comment() { awk '/^#/ { sub(/^# ?/, ""); print; next } { exit }' "$1" | tr '\n' ' '; }

# The part of a comment from one word to the next, or to its end.
part() { sed -E "s/^.*$2 //; s/ *(Parameters|Run time):.*//; s/ +$//" <<<"$1"; }

draw() {
    local name=$1 scratch=$2 line
    shift 2
    echo "$name" >&2
    local TIMEFORMAT=%U
    { time "$sidewall" run "$(drawn "$name")" -o "$scratch/$name" --quiet >/dev/null 2>"$scratch/messages"; } 2>"$scratch/seconds" ||
        { cat "$scratch/messages" >&2; return 1; }
    "$sidewall" render "$scratch/$name" -o "$pictures/$name.png" --size 640x480 "$@" >/dev/null
    line=$name,$(digest "$name"),$(awk '{ printf "%.0f", $1 < 1 ? 1 : $1 }' "$scratch/seconds")
    touch "$made"
    { grep -v "^$name," "$made" || true; echo "$line"; } | sort -t, -k1,1 >"$scratch/made"
    cp "$scratch/made" "$made"
    rm -r "${scratch:?}/$name"
}

page() {
    cat <<'TEXT'
# Gallery

Every recipe of [configs/](../configs), with a picture of the wafer as the recipe leaves it. The words are the comments at the top of
the recipes. `sidewall run configs/NAME.toml` runs one and writes to `results/NAME`. The quick form `configs/quick/NAME.toml` is
coarser and takes seconds; begin with it when you change things.

"Run time" is what the recipe says, on 2 cores. "CPU time" was measured in the run that the picture shows, over all threads. This page
and its pictures are made by `docs/make_gallery.sh`, and a test fails when a recipe has changed since.
TEXT
    local group name options form before="" text seconds
    while IFS='|' read -r group name options form; do
        [ "$group" = "$before" ] || printf '\n## %s\n' "$group"
        before=$group
        text=$(comment "configs/$name.toml")
        seconds=$(awk -F, -v name="$name" '$1 == name { print $3 }' "$made")
        printf '\n### %s\n\n![%s](pictures/%s.png)\n\n' "$name" "$name" "$name"
        fold_text "$(sed -E 's/ *(Parameters|Run time):.*//' <<<"$text")"
        printf '\n- Recipe: [configs/%s.toml](../configs/%s.toml), quick form: [configs/quick/%s.toml](../configs/quick/%s.toml)\n' \
            "$name" "$name" "$name" "$name"
        fold_text "- Parameters: $(part "$text" 'Parameters:')" "  "
        printf -- '- Run time: %s Quick form: %s\n- CPU time: %s s%s\n- Picture%s: `sidewall render results/%s -o picture.png %s`\n' \
            "$(part "$text" 'Run time:')" "$(part "$(comment "configs/quick/$name.toml")" 'Run time:')" "$seconds" \
            "${form:+ (quick form)}" "${form:+ (quick form)}" "$name" "$options"
    done < <(gallery)
}

# Lines of at most 130 characters; further ones begin with $2. What Markdown would take as markup is escaped, but in `code`.
fold_text() {
    awk -F'`' -v OFS='`' '{ for (i = 1; i <= NF; i += 2) gsub(/[<>_*]/, "\\\\&", $i) } 1' <<<"$1" |
        fold -s -w 128 | sed -E "s/ +$//; 2,\$s/^/${2:-}/"
}

check() {
    local bad=0 name size
    local said=$1
    while read -r name; do
        gallery | grep "|$name|" >/dev/null || { echo "configs/$name.toml is not in the gallery: add its line to docs/make_gallery.sh"; bad=1; continue; }
        [ -f "$pictures/$name.png" ] || { echo "$pictures/$name.png is missing: run docs/make_gallery.sh $name"; bad=1; continue; }
        size=$(stat -c %s "$pictures/$name.png")
        [ "$size" -lt 100000 ] || { echo "$pictures/$name.png has $size bytes, 100,000 or more"; bad=1; }
        grep -q "^$name,$(digest "$name")," "$made" || { echo "configs/$name.toml has changed since its picture was made: run docs/make_gallery.sh $name"; bad=1; }
    done < <(cd configs && ls ./*.toml | sed 's|^\./||; s|\.toml$||')
    while IFS='|' read -r _ name _; do
        [ -f "configs/$name.toml" ] || { echo "docs/make_gallery.sh names $name, which is no recipe of configs/"; bad=1; }
    done < <(gallery)
    [ $bad -eq 0 ] || return 1
    page | diff - docs/gallery.md >"$said" || { echo "docs/gallery.md is not what its script writes: run docs/make_gallery.sh --page"; head -20 "$said"; return 1; }
    echo "gallery: $(gallery | wc -l) recipes, each with its picture"
}

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
case "${1:-}" in
    --check) check "$scratch/difference" ;;
    --page) page >"$scratch/page"; cp "$scratch/page" docs/gallery.md ;;
    *)
        while IFS='|' read -r _ name options _; do
            if [ $# -eq 0 ] || [[ " $* " == *" $name "* ]]; then
                # shellcheck disable=SC2086  # options are words
                draw "$name" "$scratch" $options
            fi
        done < <(gallery)
        page >"$scratch/page"
        cp "$scratch/page" docs/gallery.md
        ;;
esac
