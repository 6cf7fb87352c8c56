"""Recipes and runs in a script: the program's own bytes and messages."""

import copy
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import sidewall

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
PLANE = {
    "domain": {"extent": [1.0, 1.0], "grid_spacing": 0.1},
    "layer": [{"material": "Si", "shape": "plane"}],
    "step": [{"model": "isotropic", "duration": 1.0, "rate": 0.2, "deposit": "SiO2"}],
}
TRENCH = {
    "domain": {"extent": [2.0, 0.5], "grid_spacing": 0.125},
    "layer": [{"material": "Si", "shape": "trench", "width": 1.0, "depth": 1.0}],
    "step": [{"model": "single_particle", "duration": 0.2, "rate": 1.0, "sticking": 0.3, "deposit": "SiO2"}],
    "flux": {"rays": 20000},
}


def in_space(wafer):
    return wafer | {"domain": wafer["domain"] | {"strip": "space"}}


def test_a_recipe_reads_the_same_from_a_file_a_text_and_a_dict():
    path = CONFIGS / "quick" / "isotropic_deposition.toml"
    of_file, of_text = sidewall.Recipe(path), sidewall.Recipe(path.read_text())
    assert str(of_file) == str(of_text) == str(sidewall.Recipe(str(path)))
    assert str(sidewall.Recipe(of_file._values)) == str(of_file)
    assert of_file["step[0].model"] == "isotropic" and of_file["flux.accuracy"] == 0.01


def test_notes_tell_of_a_stop_that_cannot_be_met():
    etch = {"model": "isotropic", "duration": 1.0, "rate": -0.2}
    assert not sidewall.Recipe(PLANE | {"step": [etch | {"stop_depth": 0.1}]}).notes
    assert "stop_depth" in sidewall.Recipe(PLANE | {"step": [etch | {"stop_depth": 0.5}]}).notes[0]


def test_items_are_checked_as_the_command_line_does():
    recipe = sidewall.Recipe(PLANE, {"domain.grid_spacing": 0.05})
    assert recipe["domain.grid_spacing"] == 0.05 and recipe["domain.extent"] == [1.0, 1.0]
    recipe["step[0].duration"] = np.float64(2.0)
    assert recipe["step[0].duration"] == 2.0
    before = str(recipe)
    for key, value, word in [
        ("flux.ray", 5, "did you mean rays"),
        ("flux.rays", -1, "flux.rays = -1"),
        ("step[3].duration", 1.0, "the recipe has 1, counted from 0"),
        ("step[0].rate", "fast", "must be a number or a table by material"),
        ("step[0].deposit", "SiO", "unknown material: did you mean"),
    ]:
        with pytest.raises(sidewall.RecipeError, match=word):
            recipe[key] = value
    assert str(recipe) == before
    with pytest.raises(sidewall.RecipeError, match="did you mean rays"):
        recipe["flux.ray"]
    assert recipe["flux.relative_error"] == "none" and recipe["step[0].stop_depth"] is None
    with pytest.raises(TypeError, match="no object"):
        recipe["flux.rays"] = object()


def test_a_step_is_found_by_its_name_in_loops_too():
    etch = {"name": "main etch", "model": "isotropic", "duration": 1.0, "rate": -0.1}
    recipe = sidewall.Recipe(PLANE | {"step": [{"repeat": 2, "steps": [etch, etch | {"name": "clean"}]}]})
    recipe["step.clean.duration"] = 3.0
    assert recipe["step[0].steps[1].duration"] == recipe["step.clean.duration"] == 3.0
    assert recipe['step."main etch".rate'] == -0.1
    with pytest.raises(sidewall.RecipeError, match="no step is named cleam; did you mean clean"):
        recipe["step.cleam.duration"]


def test_errors_have_the_programs_own_words(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(str(sidewall.Recipe(TRENCH)).replace("sticking = 0.3", "sticking = 1.4"))
    program = subprocess.run(["sidewall", "check", path], capture_output=True, text=True)
    with pytest.raises(sidewall.RecipeError) as caught:
        sidewall.Recipe(path)
    assert program.stderr == f"sidewall: {caught.value}\n" and "must be in [0, 1]" in program.stderr
    with pytest.raises(sidewall.FileError, match="no such file"):
        sidewall.Recipe(tmp_path / "none.toml")


def test_a_run_writes_what_the_program_writes(tmp_path):
    path = tmp_path / "trench.toml"
    path.write_text(str(sidewall.Recipe(TRENCH)))
    subprocess.run(["sidewall", "run", path, "-o", tmp_path / "program", "--quiet"], check=True)
    steps = list(sidewall.Simulation(path, tmp_path / "python"))
    names = {p.name for p in (tmp_path / "program").iterdir()}
    lock = {".sidewall.lock"}  # held while the last time step can be queried
    assert names == {p.name for p in (tmp_path / "python").iterdir()} - lock and "surface_0001.vtp" in names
    for name in names - {"summary.json", "checkpoint.vdb"}:  # these hold seconds
        assert (tmp_path / "program" / name).read_bytes() == (tmp_path / "python" / name).read_bytes(), name
    rows = (tmp_path / "python" / "timeline.csv").read_text().splitlines()[1:]
    assert len(rows) == len(steps) and steps[-1].dt == 0  # the last row is of the process step's end
    assert [float(row.split(",")[2]) for row in rows] == pytest.approx([step.time for step in steps], rel=1e-8)


def test_a_time_step_tells_of_the_wafer():
    simulation = sidewall.Simulation(TRENCH)
    assert simulation.summary is None
    for step in simulation:
        surface = step.surface()
        assert step.measures["depth"] > 0.5
        flux = step.fluxes["neutral"]
        assert flux.shape == (len(surface.triangles),) and 0.0 < flux.max() < 1.5
        assert (flux == surface.triangle_data["flux_neutral"]).all()
        names, meshes = zip(*step.layers())
        assert names == ("Si", "SiO2") and (meshes[1].points == surface.points).all()
        (line,) = step.profile("y=0.1")
        assert np.allclose(line[:, 1], 0.1) and np.ptp(line[:, 0]) == 2.0
        assert step.traced().triangle_data["flux_error_neutral"].min() >= 0
    assert step.dt == 0 and step.time == pytest.approx(0.2)
    assert simulation.summary["time"] == pytest.approx(0.2)
    # The film on the top grows at flux 1 and rate 1.
    assert surface.points[:, 2].max() == pytest.approx(0.2, abs=0.02)


def test_a_time_step_that_is_over_says_so():
    simulation = sidewall.Simulation(TRENCH)
    first = next(simulation)
    kept = first.surface()
    points = kept.points.copy()
    next(simulation)
    assert first.surface() is kept and (kept.points == points).all()
    with pytest.raises(sidewall.RecipeError, match=r"layers\(\) of the time step at 0 s: the simulation has gone on"):
        first.layers()
    folder = simulation.output
    assert folder.exists()
    del simulation, first
    assert not folder.exists()  # it was temporary
    assert (kept.points == points).all()


def test_a_run_that_was_left_goes_on_with_the_same_bits(tmp_path):
    whole = [step.time for step in sidewall.Simulation(TRENCH, tmp_path / "whole")]
    with sidewall.Simulation(TRENCH, tmp_path / "parts") as simulation:
        for step in simulation:
            if step.time > 0.1:
                break
    rest = [step.time for step in sidewall.Simulation(TRENCH, tmp_path / "parts", resume=True)]
    assert 1 < len(rest) < len(whole) and rest == whole[-len(rest):]
    for name in ("timeline.csv", "surface_0001.vtp"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()
    with pytest.raises(sidewall.RecipeError, match="of another recipe"):
        list(sidewall.Simulation(PLANE, tmp_path / "parts"))


def test_a_strip_runs_as_a_profile_and_its_meshes_are_as_wide_as_the_strip(tmp_path):
    strip, space = (sidewall.Simulation(wafer, tmp_path / name)
                    for name, wafer in {"strip": TRENCH, "space": in_space(TRENCH)}.items())
    for run in strip, space:
        last = list(run)[-1]
        for mesh in last.surface(), last.traced(), last.layers()[0][1]:
            assert np.allclose([mesh.points[:, 1].min(), mesh.points[:, 1].max()], [-0.25, 0.25])
    assert sidewall.Recipe(TRENCH)["domain.strip"] == "profile"


def test_a_law_in_python_gives_the_bits_of_its_built_in_twin(tmp_path):
    calls = []

    def law(points):
        calls.append(points.step)
        assert points.count == len(points.material) == len(points.normals) and points.visible.all()
        assert np.allclose(np.linalg.norm(points.normals, axis=1), 1.0)
        assert (points.material != points.materials["Mask"]).all()
        return 1.0 * points.fluxes["neutral"]

    own = list(sidewall.Simulation(in_space(TRENCH), tmp_path / "own"))
    twin = list(sidewall.Simulation(TRENCH, tmp_path / "twin", law=law))
    assert (own[-1].surface().points == twin[-1].surface().points).all()
    assert (tmp_path / "own" / "timeline.csv").read_bytes() == (tmp_path / "twin" / "timeline.csv").read_bytes()
    assert len(calls) == len(own) - 1 + 2 + 1  # a time step, a saved surface, and surface() here
    assert (own[-1].surface().triangle_data["rate"] == twin[-1].surface().triangle_data["rate"]).all()


def test_a_law_may_change_the_models_speeds():
    half = list(sidewall.Simulation(PLANE, law=lambda points: 0.5 * points.speeds))[-1]
    assert half.surface().points[:, 2] == pytest.approx(0.1, abs=1e-3)
    up = list(sidewall.Simulation(PLANE, law=lambda points: 0.2 * points.normals[:, 2]))[-1]
    assert up.surface().points[:, 2] == pytest.approx(0.2, abs=1e-3)


def test_a_law_that_fails_ends_the_run_with_its_own_error():
    def wrong(points):
        raise LookupError("no such rate")

    with pytest.raises(LookupError, match="no such rate"):
        list(sidewall.Simulation(PLANE, law=wrong))
    with pytest.raises(sidewall.RecipeError, match="must return an array of"):
        list(sidewall.Simulation(PLANE, law=lambda points: [1.0, 2.0]))
    with pytest.raises(sidewall.NumericsError, match="the surface speed at .* is nan"):
        list(sidewall.Simulation(PLANE, law=lambda points: np.nan * points.speeds))
    crystal = sidewall.Recipe(CONFIGS / "quick" / "wet_etch_pit.toml")
    with pytest.raises(sidewall.RecipeError, match="turns with the normal"):
        list(sidewall.Simulation(crystal, law=lambda points: points.speeds))


def test_the_recipe_may_change_between_time_steps(tmp_path):
    # 0.2 of film in the first half of the time, at 0.2 per time; 0.05 in the second, at half of it.
    recipe = sidewall.Recipe(PLANE)
    simulation = sidewall.Simulation(recipe, tmp_path / "changed")
    times = []
    for step in simulation:
        times.append(step.time)
        if step.time >= 0.5 and simulation.recipe["step[0].rate"] == 0.2:
            simulation.recipe["step[0].rate"] = 0.1
            changed = step.time
    assert recipe["step[0].rate"] == 0.2  # the simulation changed its own copy
    assert times == sorted(set(times)) and step.time == 1.0
    expected = 0.2 * changed + 0.1 * (1.0 - changed)
    assert step.surface().points[:, 2] == pytest.approx(expected, abs=1e-3)
    assert sidewall.Recipe(tmp_path / "changed" / "recipe.toml")["step[0].rate"] == 0.1
    # Every time step and the end have their rows, and a changed run resumes from its checkpoint.
    rows = (tmp_path / "changed" / "timeline.csv").read_text().splitlines()[1:]
    assert [float(row.split(",")[2]) for row in rows] == pytest.approx(times, rel=1e-8)


def test_a_changed_recipe_traces_with_it_and_resumes(tmp_path):
    def run(folder, leave=None, **options):
        simulation = sidewall.Simulation(TRENCH, tmp_path / folder, **options)
        with simulation:
            for count, step in enumerate(simulation):
                if count == 1:
                    simulation.recipe["step[0].sticking"] = 0.9
                    simulation.recipe["flux.rays"] = 30000
                if count == leave:
                    return simulation.recipe
        return simulation.recipe

    run("whole")
    changed = run("parts", leave=2)
    list(sidewall.Simulation(changed, tmp_path / "parts", resume=True))
    for name in ("timeline.csv", "surface_0001.vtp", "recipe.toml"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes(), name
    list(sidewall.Simulation(TRENCH, tmp_path / "plain"))
    assert (tmp_path / "plain" / "surface_0001.vtp").read_bytes() != (tmp_path / "whole" / "surface_0001.vtp").read_bytes()


def test_a_run_does_not_resume_with_an_edited_table_not_even_one_that_it_took_on_its_way(tmp_path):
    for name in ("first.csv", "second.csv"):
        (tmp_path / name).write_text("x,rate\n0,-1\n1,-2\n")
    table = [{"name": "rates", "file": str(tmp_path / "first.csv")}]
    step = {"model": "formula", "duration": 1.0, "rate": "rates(x)", "tables": table}
    simulation = sidewall.Simulation(PLANE | {"step": [step]}, tmp_path / "out")
    with simulation:
        for count, _ in enumerate(simulation):
            if count == 1:
                simulation.recipe["step[0].tables[0].file"] = str(tmp_path / "second.csv")
            if count == 2:
                break
    (tmp_path / "second.csv").write_text("x,rate\n0,-1\n1,-3\n")
    with pytest.raises(sidewall.FileError, match="second.csv is not what it was"):
        list(sidewall.Simulation(simulation.recipe, tmp_path / "out", resume=True))
    (tmp_path / "second.csv").write_text("x,rate\n0,-1\n1,-2\n")
    (tmp_path / "first.csv").write_text("")
    list(sidewall.Simulation(simulation.recipe, tmp_path / "out", resume=True))


def test_a_changed_recipe_does_not_reuse_the_fluxes_of_the_one_before(tmp_path):
    recipe = sidewall.Recipe(TRENCH)
    recipe["flux.reuse"] = 0.5  # kept for many time steps
    traced = []
    for step in (simulation := sidewall.Simulation(recipe, tmp_path / "out")):
        traced.append(step.dt)
        if len(traced) == 2:
            simulation.recipe["step[0].sticking"] = 0.9
    rows = (tmp_path / "out" / "timeline.csv").read_text().splitlines()
    segments = rows[0].split(",").index("segments")
    counts = [float(row.split(",")[segments]) for row in rows[1:-1]]  # nothing is traced at the end
    assert len(counts) > 2 and counts[0] > 0 and counts[1] > 0  # the changed time step traced anew


def test_setting_a_value_in_every_time_step_ends_as_the_run_does(tmp_path):
    simulation = sidewall.Simulation(PLANE, tmp_path / "out")
    for step in simulation:
        simulation.recipe["step[0].rate"] = 0.2 if step.time < 0.5 else 0.1
    assert simulation.summary is not None


def test_what_cannot_change_is_refused_and_the_run_goes_on(tmp_path):
    simulation = sidewall.Simulation(TRENCH, tmp_path / "out")
    simulation.recipe["step[0].sticking"] = 0.4  # before anything has begun
    next(simulation)
    next(simulation)
    for key, value, word in [
        ("domain.grid_spacing", 0.0625, "domain.grid_spacing"),
        ("layer[0].depth", 0.5, "layer"),
        ("step[0].duration", 1e-6, "are done"),
        ("step[0].deposit", "Si3N4", "deposit"),
        ("output.every", 0.05, "output.every"),
    ]:
        kept = copy.copy(simulation.recipe)
        simulation.recipe[key] = value
        with pytest.raises(sidewall.RecipeError, match=f"cannot change while the run goes on: .*{word}"):
            next(simulation)
        simulation.recipe = kept
    with pytest.raises(sidewall.RecipeError, match="must be in"):
        simulation.recipe["step[0].sticking"] = 1.4
    last = list(simulation)[-1]
    assert last.dt == 0
    simulation.recipe["step[0].duration"] = 0.4
    with pytest.raises(sidewall.RecipeError, match="has ended: a longer recipe"):
        next(simulation)


def test_two_simulations_do_not_disturb_each_other():
    alone = [step.surface().points for step in sidewall.Simulation(TRENCH)]
    other = sidewall.Recipe(TRENCH, {"step[0].sticking": 0.9})
    together = []
    for step, _ in zip(sidewall.Simulation(TRENCH), sidewall.Simulation(other)):
        together.append(step.surface().points)
    assert len(together) > 2 and all((a == b).all() for a, b in zip(alone, together))


def test_the_interpreter_goes_on_while_a_run_computes():
    ticks, ended = [], threading.Event()

    def tick():
        while not ended.wait(0.005):
            ticks.append(time.monotonic())

    ticker = threading.Thread(target=tick)
    ticker.start()
    began = time.monotonic()
    sidewall.flux(*sidewall.Simulation(TRENCH).__next__().surface(), sticking=0.1, rays=1e6)
    seconds = time.monotonic() - began
    ended.set()
    ticker.join()
    assert len(ticks) > 0.1 * seconds / 0.005


@pytest.mark.parametrize(
    "work",
    [
        "sidewall.flux([[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,2],[0,2,3]], rays=1e12)",
        "list(sidewall.Simulation(sidewall.Recipe(sys.argv[1], {'flux.rays': 1_000_000_000, "
        "'flux.method': 'monte-carlo'}), sys.argv[2]))",
    ],
)
def test_ctrl_c_ends_long_work_at_once(work, tmp_path):
    recipe = tmp_path / "trench.toml"
    recipe.write_text(str(sidewall.Recipe(TRENCH)))
    script = f"import sys, sidewall\nprint('ready', flush=True)\n{work}\n"
    child = subprocess.Popen([sys.executable, "-c", script, recipe, tmp_path / "out"], stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.5)
    assert child.poll() is None
    child.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, errors = child.communicate(timeout=60)
    assert "KeyboardInterrupt" in errors and child.returncode in (-signal.SIGINT, 130), errors
    assert time.monotonic() - began < 30
    if "Simulation" in work:
        assert (tmp_path / "out" / "checkpoint.vdb").exists()


def test_the_module_runs_the_command_line():
    run = subprocess.run([sys.executable, "-m", "sidewall", "--version"], capture_output=True, text=True, env=os.environ)
    version, built_with = run.stdout.splitlines()
    assert version == sidewall.__version__ and "OpenVDB" in built_with and run.returncode == 0
    run = subprocess.run([sys.executable, "-m", "sidewall", "nonsense"], capture_output=True, text=True)
    assert run.returncode == 2 and run.stderr.startswith("sidewall: there is no subcommand")
