#!/usr/bin/env bash
# outlive_test.sh PYTHON: checks by valgrind that no array reads or writes freed memory; exit code 77 with the reason where it
# cannot. Uninitialised values are not checked: packets of rays have unused lanes.
set -euo pipefail
command -v valgrind >/dev/null || { echo "skipped: there is no valgrind"; exit 77; }
"$1" -c 'import numpy' 2>/dev/null || { echo "skipped: Python has no numpy"; exit 77; }
PYTHONMALLOC=malloc valgrind -q --undef-value-errors=no --num-callers=30 --error-exitcode=9 "$1" "$(dirname "$0")/outlive.py"
