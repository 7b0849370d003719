"""`hopform.extend` by a package that is not hopform's: a study of how hard a leg is loaded, with its result, picture and
command. It uses each name that is offered.
"""

import ast
import contextlib
import importlib
import json
import sys

import pytest

import hopform
from hopform import extend

PACKAGE = """
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import hopform
from hopform.extend import (
    PALETTE, Card, Checked, Outputs, OverTime, by, dataset, falling_robot, finite, framed, in_use, items, name_axis, needs,
    option, pictures, positive, progress_bar, read_rows, robot_and_draws, shown, stream, table, whole, write,
)


@dataclass(frozen=True)
class Payload(Checked):
    mass: float = field(metadata=by(positive, "kg"))
    offset: float = field(default=0.0, metadata=by(finite, "m", -1.0))


@dataclass(frozen=True, repr=False, eq=False)
class Load(OverTime):
    stance: hopform.Stance
    payload: Payload

    @property
    def duration(self):
        return self.stance.duration

    def at(self, t):
        return self._read(t, lambda times: [self.stance.contact_force(times) / self.payload.mass])[0]

    def _over(self, t):
        return {"x2": self.stance.at(t).x2, "load": self.at(t)}

    def _card(self):
        return Card("Load", [("mass", self.payload.mass)], [("load", self.at(np.linspace(0.0, self.duration, 9)))])

    def _arrays(self):
        return {"peak": ((), float(np.max(self.at(np.linspace(0.0, self.duration, 99)))), {"units": "m/s^2"})}


def load(robot, height, payload):
    falling_robot(robot, "stance", "a drop")
    if not isinstance(payload, Payload):
        raise hopform.HopformError(f"payload must be a Payload, got {shown(payload)}")
    v2 = hopform.touchdown_velocity(robot, height)
    return Load(hopform.solve_stance(robot, v2=v2, u=0.0), payload)


def heights(path):
    source, rows = read_rows(path)
    return items("heights", [float(row[0]) for _, row in rows], f"heights of {source}", 100)


def drawn(seed, count):
    return stream(1000, seed).uniform(0.1, 0.2, whole("count", count))


def _pictures():
    needs("matplotlib", "plot", "a plot")

    def panel(axes, result):
        t = np.linspace(0.0, result.duration, 99)
        axes.plot(t, result.at(t), color=PALETTE["blue"])
        name_axis(axes, "load [m/s^2]")

    def fill(figure, result):
        with framed(figure, 4.0, 3.0, "Load", ", in m/s^2"):
            panel(figure.subplots(), result)

    return {Load: (fill, panel)}


pictures(_pictures, Load)

OPTIONS = {"Robot and start": {"height": option("of the drop", unit="m")}, "Study": {"drops": option("how many", least=1)}}


def command(height: float, drops: int = 2, json: bool = False, csv: str | None = None, plot: Path | None = None):
    outputs = Outputs(json, csv, plot)
    robot, _ = robot_and_draws("stance", None, None, None, 0, 0)
    assert in_use().own(robot) is robot
    with progress_bar("drops") as bar:
        found = [load(robot, height * (n + 1) / drops, Payload(1.0)) for n in range(drops)]
        bar(drops, drops)
    rows = [(f"{each.duration:.4f}",) for each in found]
    outputs.emit(
        lambda: [table("Loads", ("duration [s]",), rows)], picture_of=found[-1],
        json=lambda: '{"drops": %d}' % drops,
        csv=lambda: {"t": found[-1].stance.grid(3)[0]},
    )


def several(robot):
    found = [load(robot, height, Payload(1.0)) for height in (0.1, 0.2)]
    return dataset({"duration": (("drop",), [each.duration for each in found])}, "two drops")


def saved(path, robot):
    write({path: {"t": [0.0, 1.0]}})
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("outside")
    (folder / "hopform_study.py").write_text(PACKAGE, encoding="utf-8")
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module("hopform_study")
    finally:
        sys.path.remove(str(folder))
        del sys.modules["hopform_study"]


def test_the_package_uses_each_name_that_is_offered_and_nothing_private():
    (taken,) = (
        {alias.name for alias in node.names}
        for node in ast.walk(ast.parse(PACKAGE))
        if isinstance(node, ast.ImportFrom) and node.module == "hopform.extend"
    )
    assert taken == {*extend.__all__} and "hopform._" not in PACKAGE
    used = {node.id for node in ast.walk(ast.parse(PACKAGE)) if isinstance(node, ast.Name)}
    assert taken <= used


def test_a_result_of_another_package_shows_itself(study, hopper_c):
    load = study.load(hopper_c, 0.2, study.Payload(2.0))
    assert load.at(0.05) == load.stance.contact_force(0.05) / 2.0
    first, given, found = repr(load).splitlines()
    assert (first, given.strip()) == ("Load", "mass = 2") and found.strip().endswith(" .. 68.418")
    with pytest.raises(hopform.HopformError, match="t must be 0 <= t <= "):
        load.at(9.0)
    pytest.importorskip("xarray")
    assert load.to_xarray().peak.attrs["units"] == "m/s^2"
    assert study.several(hopper_c).duration.shape == (2,)


def test_what_another_package_takes_is_checked(study, hopper_c, tmp_path):
    with pytest.raises(hopform.HopformError, match=r"mass must be > 0 kg, got -1\.0"):
        study.Payload(-1.0)
    with pytest.raises(hopform.HopformError, match=r"offset must be >= -1 m, got -2\.0"):
        study.Payload(1.0, -2.0)
    with pytest.raises(hopform.HopformError, match="payload must be a Payload, got 3"):
        study.load(hopper_c, 0.2, 3)
    with pytest.raises(hopform.HopformError, match=r"count must be a whole number >= 1, got 0"):
        study.drawn(0, 0)
    assert study.drawn(7, 3).tolist() == study.drawn(7, 3).tolist() != study.drawn(8, 3).tolist()
    file = tmp_path / "heights.csv"
    file.write_text("0.1\n\n0.2\n")
    assert study.heights(file) == [0.1, 0.2]
    study.saved(tmp_path / "t.csv", hopper_c)
    assert (tmp_path / "t.csv").read_text() == "t\n0.0\n1.0\n"


def test_a_picture_of_another_package_is_drawn(study, hopper_c):
    pytest.importorskip("matplotlib")
    load = study.load(hopper_c, 0.2, study.Payload(2.0))
    axes = load.plot()
    assert axes.get_ylabel() == "load [m/s^2]" and "Load" in axes.figure.get_suptitle()


def test_a_command_of_another_package_prints_and_writes(study, capsys, tmp_path):
    study.command(0.2)
    assert "duration [s]" in capsys.readouterr().out
    study.command(0.2, 3, json=True)
    assert json.loads(capsys.readouterr().out) == {"drops": 3}
    with contextlib.chdir(tmp_path):
        study.command(0.2, csv="t.csv")
    assert (tmp_path / "t.csv").read_text().splitlines()[0] == "t"
    with pytest.raises(hopform.HopformError, match="--json and --csv - both print"):
        study.command(0.2, json=True, csv="-")
