"""The ledger of every model against its energy, as the commands print both: over random starts, of which some run into
a stop at t = 0, and of coordinates that count from another origin.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
import sympy as sp

import hopform
from derive.maths import energy
from derive.model.quantities import x1, x2
from derive.model_file import read_model
from hopform._cli import tables, use
from tests import needs
from tests.conformance.test_endings import FILES, Problem, drawn_problem, solved
from tests.conformance.zoo import Draw
from tests.derived import MODELS, built, solver_of

pytestmark = needs.library
ROUNDING = 1e-12
"""Of a sum, over the energies that flow and those between which the difference is taken."""


def starts(problem: Problem) -> Iterator[tuple[Problem, bool]]:
    """A problem, and the same with a stop where its first mass starts, into which it runs; whether it does."""
    yield problem, False
    names = list(problem.start)
    position, velocity = names[0], names[len(names) // 2]
    for end, side in (("min", -1.0), ("max", 1.0)):
        if (stop := f"{position}_{end}") in problem.robot and problem.start[position] != 0.0:
            v = side * max(abs(problem.start[velocity]), 0.1 * abs(problem.start[position]))
            start = problem.start | {velocity: v}
            robot = problem.robot | {f"{position}_min": -math.inf, f"{position}_max": math.inf}
            robot = {name: value for name, value in robot.items() if name in problem.robot}
            yield replace(problem, robot=robot | {stop: problem.start[position]}, start=start), True


def energy_of(motion: Any, start: Any) -> float:
    """H of a state of the engine, by the derived formula."""
    return float(motion.robot.solver.package.formulas.energies(motion.robot.parameters, start).total)


def assert_balanced(motion: Any) -> float:
    """What the commands print of a motion adds up; what a stop took at its start, which is said as well."""
    record = json.loads(tables.motion_json(motion))
    before, after = record["total_energy"]
    entries = [value for own in record["ledger"].values() for value in own.values()]
    scale = sum(map(abs, entries)) + abs(before) + abs(after)
    assert abs(before - energy_of(motion, motion._asked[0])) <= ROUNDING * scale
    assert abs(math.fsum(entries) - (after - before)) <= ROUNDING * scale
    if isinstance(motion, hopform.Stance):
        stance = json.loads(tables.stance_json(motion, None))
        changes = {name: stance["energy"]["end"][name] - stance["energy"]["start"][name] for name in ("body", "total")}
        of = motion.robot.solver.package.records
        for name, parts in (("total", of.LEDGER_OF_ROBOT), ("body", of.LEDGER_OF_BODY)):
            ends = sum(abs(stance["energy"][end][name]) for end in ("start", "end"))
            scale = max(scale, sum(abs(stance["ledger"][part]) for part in parts) + ends)
            assert abs(math.fsum(stance["ledger"][part] for part in parts) - changes[name]) <= ROUNDING * scale
    for column in tables.ledger(motion).columns[1:]:
        assert abs(float(list(column.cells)[-1])) <= ROUNDING * scale
    return -tables.lost_at_start(motion)


@pytest.mark.parametrize("name", needs.the_first(["leg_damper", *sorted(set(FILES) - {"leg_damper"})]))
def test_the_ledger_that_is_printed_is_the_change_of_the_energy(store, monkeypatch, name):
    folder = "hopper" if name == "hopper" else str(built(store, FILES[name]))
    solver, lost = hopform.load_solver(folder), 0
    monkeypatch.setattr(use, "in_use", lambda: solver)
    for seed in range(12):
        _, drawn = drawn_problem(solver, name, Draw(f"{name} ledgers {seed}"))
        for problem, runs_into_stop in starts(drawn):
            try:
                motion = solved(solver, problem)
            except hopform.HopformError:  # with the stop, the numbers leave the range
                continue
            loss = assert_balanced(motion)
            said = tables.loss_at_start(motion)
            assert (loss < 0.0) == bool(said) and (loss < 0.0 or not runs_into_stop)
            lost += runs_into_stop
    assert lost > 0 or not any(stop.endswith(("_min", "_max")) for stop in drawn.robot)


@pytest.mark.parametrize("name", sorted(FILES))
def test_no_entry_of_a_ledger_counts_from_the_origin_of_the_coordinates(name):
    """Where all coordinates may be counted from another place: not where one moves alone, against the frame, and not
    over the ground.
    """
    model, by = read_model(FILES[name]), sp.Symbol("by", real=True)

    def moved(value: Any) -> Any:
        return sp.expand(sp.sympify(value).subs({x1: x1 + by, x2: x2 + by}, simultaneous=True) - value)

    assert model.moves_alone or [moved(each) for each in model.accelerations] == [0, 0]
    if not (model.moves_alone or model.has_contact):
        powers = energy.powers(model)
        assert {entry: moved(power) for entry, power in powers.items()} == dict.fromkeys(powers, 0)


def test_a_ledger_is_the_same_a_thousand_metres_away(store):
    """Of two masses between which a spring acts, by numbers that shift without rounding."""
    solver = solver_of(store, MODELS / "tendon.py")
    robot = solver.Robot(d_min=-math.inf, d_max=math.inf)
    positions = [
        name for name, unit in zip(solver.solve_motion(robot).units, ("rad", "", "rad", ""), strict=True) if unit
    ]
    here = dict.fromkeys(positions, 0.0) | {positions[0]: 0.25}
    motions = [
        solver.solve_motion(robot, start={name: place + shift for name, place in here.items()}, u=2.0, horizon=0.5)
        for shift in (0.0, 1024.0)
    ]
    near, far = (motion.ledger(motion.duration)._asdict() for motion in motions)
    assert sum(map(abs, near.values())) > 1e-3
    assert far == pytest.approx(near, rel=1e-9, abs=1e-12)
