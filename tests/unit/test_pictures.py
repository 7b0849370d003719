"""Every picture that ships is one that a reader can read: no word overlaps another or leaves the picture, no marker lies on
the frame, and no axis with numbers is without a name.
"""

import runpy
import shlex
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import hopform
import hopform.hopping
import hopform.identify
from docs import gallery
from hopform import _figures as results
from hopform import _front as cli
from hopform._figures import plots
from hopform.hopping import _scene as animation
from hopform.hopping.controllers import FeedForward
from hopform.hopping.terrain import uniform
from tests import needs
from tests.derived import solver_of
from tests.needs import sliced
from tests.pictures import faults
from tests.seeds import SEED

ROOT = Path(__file__).resolve().parents[2]
HOPPER = hopform.load_robot("hopper_c")
DROP = {"v2": -1.93}


def run(count: int = 3, name: str = "hopper_c", height: float = 0.2) -> hopform.hopping.Run:
    return hopform.hopping.simulate(
        hopform.load_robot(name), uniform(count, 0.02, seed=1), FeedForward(height), height=height
    )


RESULTS: dict[str, Callable[[], Any]] = {
    "stance": lambda: hopform.solve_stance(HOPPER, **DROP, u=3.0),
    "run": lambda: run(12),
    "stance at rest": lambda: hopform.solve_stance(HOPPER, v2=-0.3, u=1.0),
    "stance, five events": lambda: hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), u=0.75),
    "stance, steps": lambda: hopform.solve_stance(HOPPER, v2=-0.61, u=[(0.0, 0.0), (0.05, 2.0), (0.1, -3.0)]),
    "stance, 100 steps": lambda: hopform.solve_stance(
        HOPPER, v2=-1.9, u=[(0.001 * n, 3.0 * (-1) ** n) for n in range(100)]
    ),
    "stance, two events near its end": lambda: hopform.solve_stance(
        HOPPER, v2=-1.63, u=[(0.0, 1.2), (0.174, -2.6), (0.185, -0.2)]
    ),
    "stance, horizon": lambda: hopform.solve_stance(HOPPER, v2=-1.0, horizon=0.05),
    "stance, take-off at once": lambda: hopform.solve_stance(HOPPER, v2=1.0),
    "flight": lambda: hopform.solve_stance(HOPPER, **DROP, u=3.0).fly(0.01),
    "hop": lambda: run().hops[1],
    "first hop": lambda: run().hops[0],
    "one hop": lambda: hopform.hopping.simulate(HOPPER, [0.0], 3.0, height=0.2),
    "no hop": lambda: hopform.hopping.simulate(HOPPER, [0.0, 0.0], 0.0, height=0.001),
    "run at 0 A": lambda: hopform.hopping.simulate(HOPPER, [0.0] * 7, 0.0, height=0.2),
    **{f"run of {name}": lambda name=name: run(3, name, 0.1) for name in hopform.ROBOTS},
    "flights": lambda: hopform.solve_flights(HOPPER, v2=np.linspace(0.5, 2.0, 4)[:, np.newaxis], x1=[0.0, 0.03, 0.05]),
    "hops": lambda: hopform.solve_hops(HOPPER, height=np.linspace(0.02, 0.2, 21), u=2.0, hops=5),
    "batch": lambda: hopform.solve_stances(HOPPER, v2=np.linspace(-2.0, -1.0, 5), u=2.0),
    "batch of two dimensions": lambda: hopform.solve_stances(
        HOPPER, v2=np.linspace(-2.0, -1.0, 5)[:, np.newaxis], u=np.array([0.0, 1.0, 2.0])
    ),
    "batch of one": lambda: hopform.solve_stances(HOPPER, v2=-1.9, u=2.0),
    "sensitivities": lambda: hopform.solve_stance(HOPPER, **DROP, u=3.0).sensitivities,
    "reachability": lambda: hopform.reachability(
        HOPPER, np.linspace(0.02, 0.3, 15), np.linspace(0.0, 3.0, 5), stop_margin=0.015
    ),
    "reachability of one current": lambda: hopform.reachability(HOPPER, np.linspace(0.02, 0.3, 15), [3.0]),
    "command": lambda: hopform.choose_current(HOPPER, **DROP, h_des=0.2),
    "command, nearest": lambda: hopform.choose_current(HOPPER, **DROP, h_des=2.0),
    "recording": lambda: hopform.identify.record(HOPPER, "air", duration=4.0, seed=1),
    "recording of a drop": lambda: hopform.identify.record(HOPPER, "drop", seed=1),
    "fit": lambda: hopform.identify.fit_robot(
        decays=hopform.identify.record(HOPPER, "decay", height=0.04, duration=1.0, seed=3), known={"m_s": 3.0},
        holdout=False,
    ),
    "motion of a hopper": lambda: hopform.solve_motion(HOPPER, start={"x1": 0.02, "v2": -1.9}, u=3.0),
}  # fmt: skip
"""Results of every type that has a plot, and of what they may have or lack."""

COMMANDS = {
    "hop": "hop --height 0.2 --terrain uniform --controller exact --h-des 0.2 --plot a.png",
    "stance": "stance --height 0.2 --u 3 --plot a.png",
    "hop at 3 A": "hop --height 0.2 --u 3 --plot a.png",
    "hop with bands": "hop --height 0.2 --hops 3 --from-fit mine.toml --draws 5 --plot a.png",
    "control": "control --height 0.2 --h-des 0.2 --plot a.png",
    "control with bands": "control --height 0.2 --h-des 0.2 --from-fit mine.toml --draws 5 --plot a.png",
    "reach": "reach --heights 9 --currents 4 --plot a.png",
    "reach with bands": "reach --heights 5 --currents 3 --from-fit mine.toml --draws 5 --plot a.png",
    "motion": "motion --start x1=0.02 --start v2=-1.9 --u 3 --plot a.png",
    "identify": "identify all step.csv decay:decay.csv --known m_s=3 --known m_eff=25 --plot a.png",
    "fit": "fit motion.csv --fitted m_eff,k,b1,b2,f1,f2,gamma2 --known m_s=3 --known L0=0.4 --plot a.png",
}
"""Commands that draw; those with bands after a robot has been identified, `fit` and `identify` after recordings."""
BEFORE = {
    "mine.toml": ("record drop --seed 1 --csv drop.csv", "identify drop drop.csv --known m_s=3 --out mine.toml"),
    "step.csv": ("record step --seed 2 --csv step.csv", "record decay --seed 2 --csv decay.csv"),
    "motion.csv": (
        "record motion --start x1=0.02 --start x2=0.4 --u-steps 0:1.2,0.3:-0.4,0.6:1,0.9:-0.3,1.2:1 --seed 1 "
        "--csv motion.csv",
    ),
}
"""The commands that make a file."""


def the_first(names) -> list[Any]:
    """The first two in the default run, the others with `make test-slices`."""
    return [*[*names][:2], *sliced(*((name,) for name in [*names][2:]))]


@cache
def result(name: str) -> Any:
    return RESULTS[name]()


@pytest.mark.parametrize("name", the_first(RESULTS))
def test_a_picture_of_a_result_can_be_read(name):
    assert faults(results.figure_of(result(name))) == []


@pytest.mark.sliced
def test_every_type_of_result_is_among_them():
    """But for a motion of a model other than the hopper, which has a test of its own below."""
    known = {each.__name__ for each in results.PICTURES if each.__module__.startswith("hopform.")}
    assert {type(result(name)).__name__ for name in RESULTS} | {"Motion"} == known


@pytest.mark.parametrize("name", the_first(RESULTS))
def test_the_main_panel_of_a_result_can_be_read_where_a_user_puts_it(name):
    whole = results.figure_of(result(name))
    with plots.house_style():
        figure = Figure(figsize=(6.4, 3.6) if len(whole.axes) > 2 else whole.get_size_inches(), layout="constrained")
        axes = figure.subplots()
    result(name).plot(axes)
    assert faults(figure, legends=False) == []


@pytest.mark.parametrize("name", the_first(COMMANDS))
def test_what_a_command_draws_can_be_read(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    drawn = list[Figure]()
    line = shlex.split(COMMANDS[name])
    for file, commands in BEFORE.items():
        if file in line:
            assert [cli.main(shlex.split(each)) for each in commands] == [0] * len(commands)
    monkeypatch.setattr(plots, "render", lambda figure, suffix: drawn.append(figure) or b"")
    assert cli.main(line) == 0
    assert faults(*drawn) == []


@pytest.mark.sliced
@pytest.mark.parametrize(("model", "furthest"), [("joint", 0.1), ("sea", 0.1), ("servo", 0.1), ("relief_valve", 0.004)])
def test_the_picture_of_a_motion_of_any_model_can_be_read(store, model, furthest):
    solver = solver_of(store, model)
    robot = solver.Robot(**{field.name: 1.0 for field in solver.Robot.fields() if field.default is None})
    first = next(iter(solver.solve_motion(robot).units))
    for start in np.random.default_rng(SEED).uniform(0.0, furthest, 3).tolist():
        moved = solver.solve_motion(robot, start={first: start}, u=[(0.0, 0.0), (0.2, 1.0)], horizon=1.0)
        assert faults(results.figure_of(moved)) == []


@pytest.mark.sliced
def test_the_events_of_any_stance_are_named_without_running_into_each_other():
    draw = np.random.default_rng(SEED)
    for _ in range(40):
        times = np.concatenate([[0.0], np.sort(draw.uniform(0.0, 0.4, 3))])
        steps = list(zip(times.tolist(), draw.uniform(-3.0, 3.0, 4).tolist(), strict=True))
        stance = hopform.solve_stance(HOPPER, v2=float(draw.uniform(-2.5, -0.05)), u=steps)
        assert faults(results.figure_of(stance)) == [], (stance.phases[0].state, steps)


@pytest.mark.parametrize("number", [9, 12, *sliced(*((n,) for n in gallery.DRAWN if n not in (9, 12)))])
def test_a_figure_of_the_paper_can_be_read(number):
    assert faults(gallery.draw(number).figure) == []


@pytest.mark.sliced
@needs.library
def test_the_figures_of_the_explanations_can_be_read():
    pages = runpy.run_path(str(ROOT / "docs" / "explanation" / "figures.py"))
    with plots.house_style():
        assert {each.__name__: faults(each()) for each in pages["FIGURES"]} == {
            each.__name__: [] for each in pages["FIGURES"]
        }


@pytest.mark.sliced
def test_a_picture_of_the_animation_can_be_read():
    with plots.house_style():
        figure = Figure(figsize=(5.4, 3.6), dpi=100, layout="constrained")
        place = animation.scene(figure.subplots(), result("run"), 0.2)
        for t in (0.0, 0.4, 1.0):
            place(t)
            assert faults(figure) == []
