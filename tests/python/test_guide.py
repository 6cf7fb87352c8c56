"""The guide's Python: its blocks and examples run."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))


def run(folder, *command):
    """Standard output of a script that runs beside the recipes."""
    (folder / "configs").symlink_to(ROOT / "configs")
    done = subprocess.run([sys.executable, *command], cwd=folder, env=os.environ, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers(line):
    return [float(word) for word in re.findall(r"\d+\.\d+", line)]


@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_the_blocks_of_a_page_run(page, tmp_path):
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)
    assert blocks
    run(tmp_path, "-c", "\n".join(blocks))


def test_examples_are_listed_and_tested():
    page = (ROOT / "docs" / "python.md").read_text()
    assert all(f"(examples/{path.name})" in page for path in EXAMPLES)
    assert {path.stem for path in EXAMPLES} == {"step_coverage", "custom_model", "fit_scipy", "other_mesh"}


def test_step_coverage_falls_with_sticking(tmp_path):
    lines = run(tmp_path, ROOT / "docs/examples/step_coverage.py", "0.1", "1").splitlines()
    low, high = (numbers(line)[-1] for line in lines[1:3])
    assert 0.0 < high < low < 1.0
    assert (tmp_path / "step_coverage.png").exists() != ("no matplotlib: no plot" in lines)


def test_a_law_in_python_etches_half_a_micrometre_a_second_at_most(tmp_path):
    depth = numbers(run(tmp_path, ROOT / "docs/examples/custom_model.py").splitlines()[-2])[-1]
    # J N / (J + N) is at most 1/2 where both are at most 1, and in a shallow trench not much less.
    assert 0.4 < depth < 0.52


def test_scipy_finds_what_was_measured(tmp_path):
    pytest.importorskip("scipy")
    sticking, rate, miss = numbers(run(tmp_path, ROOT / "docs/examples/fit_scipy.py"))
    # The film on top is rate times 0.3 s at flux 1.
    assert abs(rate - 0.24 / 0.3) < 0.02
    assert 0.3 < sticking < 1.0 and miss < 0.002


def test_a_half_sphere_of_another_library_has_the_flux_that_view_factors_give(tmp_path):
    for line in run(tmp_path, ROOT / "docs/examples/other_mesh.py").splitlines():
        flat, bottom, exact = numbers(line.split("flux")[1])
        # The half sphere has 38 chords across, which lie above it, the more so at its steep rim.
        assert abs(flat - 1.0) < 0.02 and abs(bottom - exact) < 0.05 * exact
