"""What ends a motion where an event comes at the same time: the derivatives of the ending, of every model, against
differences of the solver.

A draw of the zoo is changed so that an event and the ending coincide: a stop lies on the path, where it may take from
the contact force what a damper carried; a leg pulls from the start, or extends; the horizon is the time of an event; the
input steps there; the actuator begins to slip as the leg takes off. Where the derivative is one-sided, the difference is
that of the side on which the list stays.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import hopform
from hopform._solver.c import C
from tests import needs
from tests.conformance.legs import MOST, Legs
from tests.conformance.zoo import EQUATIONS, Draw, Scales
from tests.conformance.zoo import case as drawn_case
from tests.derived import MODELS, SHIPPED, solver_of

pytestmark = needs.library
Array = NDArray[np.float64]
TOLERANCE = 1e-6
"""Of a derivative, over the largest of its row by a relative change of an input."""
STEPS = (1e-5, 1e-4, 1e-6)
"""Of the differences, over the size of an input: the first whose extrapolation agrees, or the one where it does best."""


@dataclass(frozen=True)
class Problem:
    """A motion that is asked for: a robot's numbers, the start by names, the steps of the input."""

    robot: dict[str, float]
    start: dict[str, float]
    steps: tuple[tuple[float, float], ...]
    horizon: float

    def moved(self, name: str, by: float) -> "Problem":
        """One input moved; a name that is neither of the robot nor of the start is that of the model's input."""
        if name in self.start:
            return replace(self, start=self.start | {name: self.start[name] + by})
        if name in self.robot:
            return replace(self, robot=self.robot | {name: self.robot[name] + by})
        return replace(self, steps=tuple((t, u + by) for t, u in self.steps))

    def size(self, name: str) -> float:
        """Of an input: its own, or where that is 0 a small one."""
        value = self.start.get(name, self.robot.get(name, max((abs(u) for _, u in self.steps), default=0.0)))
        return max(abs(value), 1e-2) if math.isfinite(value) else 1.0

    def goes_into_a_stop(self, name: str, by: float) -> bool:
        """Whether a velocity at rest on a stop moves so: the stop takes it, and it is no input to that side."""
        count, names = len(self.start) // 2, list(self.start)
        if name not in names[count:] or abs(self.start[name]) > 0.0:
            return False
        at = names[names.index(name) - count]
        return self.robot.get(f"{at}_{'max' if by > 0.0 else 'min'}") == self.start[at]


def solved(solver: Any, problem: Problem) -> Any:
    robot = solver.Robot(**problem.robot)
    u = list(problem.steps) if len(problem.steps) > 1 else problem.steps[0][1]
    return solver.solve_motion(robot, start=problem.start, u=u, horizon=problem.horizon)


def list_of(motion: Any) -> tuple[Any, ...]:
    """What must stay the same for a difference: events, modes, the ending, and whether it comes with what began the last
    phase. A motion that ends at once has no use for its modes.
    """
    events = tuple(event.kind for event in motion.events)
    modes = tuple((phase.mode_1, phase.mode_2) for phase in motion.phases if motion.duration > 0.0)
    return events, modes, motion.status, motion.duration == motion.phases[-1].start


def values_of(motion: Any, rows: tuple[str, ...]) -> Array:
    """The rows of the matrix, as values."""
    return np.array(
        [motion.duration if row == "T" else getattr(motion, row, getattr(motion.end, row, math.nan)) for row in rows]
    )


class Differences:
    """Derivatives of a solver's motion by differences on the sides on which its list stays."""

    def __init__(self, solver: Any, problem: Problem, motion: Any) -> None:
        self.solver, self.problem, self.rows = solver, problem, motion.sensitivities.rows
        self.list, self.here = list_of(motion), values_of(motion, self.rows)

    def _at(self, name: str, by: float) -> Array | None:
        if self.problem.goes_into_a_stop(name, by):
            return None
        try:
            motion = solved(self.solver, self.problem.moved(name, by))
        except hopform.HopformError:  # not in the domain of the input
            return None
        return values_of(motion, self.rows) if list_of(motion) == self.list else None

    def _towards(self, name: str, step: float) -> Array | None:
        """Slopes over a step, its half and its quarter to one side."""
        there = [self._at(name, step / n) for n in (1, 2, 4)]
        if any(values is None for values in there):
            return None
        return np.array([(values - self.here) / (step / n) for values, n in zip(there, (1, 2, 4), strict=True)])

    def by(self, name: str, scales: Array) -> list[tuple[Array, Array]]:
        """The derivative by an input and how well it is known; of both sides where there is a kink between them, and
        none where the list stays on no side. scales: what a derivative's doubt is small against.
        """
        choices = []
        for relative in STEPS:
            step = relative * self.problem.size(name)
            sides = [side for side in (self._towards(name, step), self._towards(name, -step)) if side is not None]
            found = [
                (2.0 * quarter - half, (whole - 6.0 * half + 8.0 * quarter) / 3.0) for whole, half, quarter in sides
            ]
            known = [(fine, np.abs(fine - coarse)) for coarse, fine in found]
            if len(sides) == 2 and smooth(*known):  # odd powers cancel
                whole, half, quarter = np.mean(sides, axis=0)
                fine, coarse = (4.0 * quarter - half) / 3.0, (4.0 * half - whole) / 3.0
                known = [(fine, np.abs(fine - coarse))]
            if known:
                choices.append((max(float(np.nanmax(doubt / scales)) for _, doubt in known), known))
                if choices[-1][0] <= 0.1 * TOLERANCE:
                    break
        return min(choices, key=lambda choice: choice[0])[1] if choices else []


def smooth(one: tuple[Array, Array], other: tuple[Array, Array]) -> bool:
    """Whether the derivatives of both sides are one."""
    size = np.abs(one[0]) + np.abs(other[0])
    return not np.any(np.abs(one[0] - other[0]) > 4.0 * (one[1] + other[1]) + 1e-3 * size)


def largest_of(motion: Any) -> dict[str, float]:
    """The largest size of each coordinate and velocity over the motion: what has faded has no digits beyond that."""
    states = np.abs(np.array(motion.at(np.linspace(0.0, motion.duration, 33))))
    return dict(zip(motion.end._fields, states.max(axis=1).tolist(), strict=True))


def wrong_entries(solver: Any, problem: Problem, motion: Any) -> tuple[list[str], int]:
    """Entries of the matrix that are not those of differences, and how many were compared."""
    matrix = motion.sensitivities
    own = {column: name for name, column in matrix.aliases.items()}
    columns = [own.get(column, column) for column in matrix.columns]
    sizes = np.array([problem.size(name) for name in columns])
    differences, wrong, compared = Differences(solver, problem, motion), list[str](), 0
    scales = np.max(np.nan_to_num(np.abs(matrix.matrix)) * sizes, axis=1, initial=0.0)
    scales = np.maximum(scales, 1e-3 * np.nan_to_num(np.abs(differences.here)) + 1e-9)
    scales = np.maximum(scales, [1e-5 * largest_of(motion).get(row, 0.0) for row in matrix.rows])
    for n, name in enumerate(columns):
        if not math.isfinite(problem.robot.get(name, 0.0)):
            continue
        sides = []
        for value, doubt in differences.by(name, scales / sizes[n]):
            known = ~np.isnan(value) & (doubt * sizes[n] <= 0.1 * scales)
            # near a time that runs away, as of a stop that is hardly reached, steps that shrink do not converge
            known &= doubt * sizes[n] <= 1e-2 * np.abs(value) * sizes[n] + TOLERANCE * scales
            far = known & ~(
                np.abs(matrix.matrix[:, n] - value) * sizes[n] <= TOLERANCE * scales + 2.0 * doubt * sizes[n]
            )
            said = [
                f"d {matrix.rows[m]}/d {name}: {matrix.matrix[m, n]} for {value[m]} +- {doubt[m]}"
                for m in np.flatnonzero(far)
            ]
            sides.append((said, int(known.sum())))
        said, known = min(sides, key=lambda side: len(side[0]), default=([], 0))
        wrong, compared = wrong + said, compared + known
    return wrong, compared


# ---- an event and an ending at the same time ----


OWN = ("feedforward", "further_forces", "joint", "monoped", "rig", "stranger")
"""The models of tests/models that can be built and are none of those that ship."""
FILES = {name: SHIPPED / f"{name}.py" for name in EQUATIONS}
FILES |= {name if name not in FILES else f"own {name}": MODELS / f"{name}.py" for name in OWN}


def with_stop_on_the_path(solver: Any, problem: Problem, contact: Any, draw: Draw) -> Iterator[Problem]:
    """A stop where the motion passes: where that takes a contact force below 0, if there is such a place, and anywhere."""
    count = len(problem.start) // 2
    positions, velocities = (list(problem.start)[part] for part in (slice(count), slice(count, None)))
    stops = {f"{name}_{end}": size for name in positions for end, size in (("min", -math.inf), ("max", math.inf))}
    robot = problem.robot | {name: size for name, size in stops.items() if name in problem.robot}
    motion = solved(solver, replace(problem, robot=robot))
    places: list[tuple[bool, Problem]] = []
    for t in np.linspace(0.0, motion.duration, 42)[1:-1]:
        state = motion.at(t)
        q, v = (np.array([getattr(state, name) for name in names]) for names in (positions, velocities))
        for n, name in enumerate(positions):
            stop = f"{name}_{'max' if v[n] > 0.0 else 'min'}"
            if stop in robot and (q[n] - problem.start[name]) * v[n] > 0.0:
                pulls = contact is not None and contact(q, v * (np.arange(count) != n)) < 0.0
                places.append((pulls, replace(problem, robot=robot | {stop: float(q[n])})))
    for pulls in (True, False):
        of_kind = [place for takes, place in places if takes == pulls]
        if of_kind:
            yield draw.choice(of_kind)


def that_leaves_at_once(problem: Problem, contact: Any, draw: Draw) -> Iterator[Problem]:
    """A leg that pulls from the start, if a damper does in it, and one that carries nothing and extends."""
    if contact is None:
        return
    names = list(problem.start)
    at = np.array([problem.start[name] for name in names])
    q, v = at[: len(at) // 2], at[len(at) // 2 :]
    body = np.arange(len(v)) == len(v) - 1
    carries, rate = contact(q, v), contact(q, v + body) - contact(q, v)
    if rate < 0.0:
        yield replace(problem, start=problem.start | {names[-1]: float(v[-1] - 1.2 * carries / rate)})
        return
    stiffness = contact(q, v) - contact(q + body, v)
    start = problem.start | {
        names[len(q) - 1]: float(q[-1] + carries / stiffness),
        names[-1]: float(v[-2] + draw.over(0.1, 1.0)),
    }
    yield replace(problem, start=start)


def that_slips_at_take_off(problem: Problem, draw: Draw) -> Iterator[Problem]:
    """An actuator on its lower stop whose friction at rest is what lifts it: it slips as the leg carries nothing."""
    robot, u = problem.robot, problem.steps[0][1]
    if not robot.get("gamma2") or "x1_min" not in robot or "k_emf" in robot:
        return
    current = -math.copysign(abs(u) + 1e-2, robot["gamma2"])
    excess = draw.choice([0.0, draw.uniform(0.0, 1.0)]) * abs(robot["gamma2"] * current) / robot["m_eff"]
    friction = {"c": 0.0, "f1": abs(robot["gamma2"] * current) / robot["m_eff"] - excess, "f1_excess": excess}
    start = problem.start | {"v1": 0.0, "x1": 0.0, "x2": problem.start["x2"] - problem.start["x1"] - robot["c"]}
    yield replace(problem, robot=robot | friction | {"x1_min": 0.0}, start=start, steps=((0.0, current),))


def drawn_problem(solver: Any, name: str, draw: Draw) -> tuple[Any, Problem]:
    """The first case of a draw that is a robot and a start of the model; without b12 it would be the hopper."""
    while True:
        case = drawn_case(FILES[name], draw, Scales(draw))
        if case.robot.get("b12") == 0.0:
            continue
        try:
            given = solver.Robot(**case.robot)
            robot = {field.name: getattr(given, field.name) for field in solver.Robot.fields()}
            problem = Problem(robot, case.start, case.steps, case.horizon)
            solved(solver, problem)
        except hopform.HopformError:
            continue
        return case, problem


def coincidences(solver: Any, name: str, draw: Draw) -> Iterator[Problem]:
    """Problems of a draw of the zoo at whose ending something else happens, too."""
    case, problem = drawn_problem(solver, name, draw)
    robot = problem.robot
    contact = case.mechanism.contact if "stance" in solver.can else None
    extends, at_stop = problem, contact
    if contact is not None and robot.get("gamma2"):
        force = robot["m_eff"] * (robot["f1"] + robot["f1_excess"]) + robot["m_s"] * robot["g"] * draw.over(1.0, 10.0)
        extends = replace(problem, steps=((0.0, -force / robot["gamma2"]),))
    if contact is not None and "b12" in robot:  # as much as makes the contact force jump
        more = draw.uniform(1.0, 4.0) * math.sqrt(robot["k"] * robot["m_s"])
        extends, at_stop = extends.moved("b12", more), lambda q, v: contact(q, v) + more * (v[0] - v[1])
    bases = [
        problem, *with_stop_on_the_path(solver, extends, at_stop, draw), *that_leaves_at_once(problem, contact, draw),
        *that_slips_at_take_off(problem, draw),
    ]  # fmt: skip
    for base in bases:
        try:
            motion = solved(solver, base)
        except hopform.HopformError:  # by rounding the leg is longer than it may be
            continue
        yield base
        times = {*(event.time for event in motion.events), *(phase.start for phase in motion.phases), motion.duration}
        for t in sorted(t for t in times if 0.0 < t < base.horizon)[-2:]:
            yield replace(base, horizon=t)
            u = base.steps[-1][1]
            yield replace(base, steps=(*(step for step in base.steps if step[0] < t), (t, draw.uniform(-2.0, 2.0) * u)))


def pair_of(motion: Any) -> tuple[str, str]:
    """What happens at the ending, and the ending."""
    if motion.duration == 0.0:
        return "start", motion.status
    events = [event.kind for event in motion.events if event.time == motion.duration]
    at_once = motion.phases[-1].start == motion.duration
    return (events[-1] if events else "step" if at_once else "nothing"), motion.status


PULLED = {("start", "takeoff"), ("x1_hits_stop", "takeoff")}
"""What ends the contact without a root of its force, where a damper acts in the leg."""


@pytest.mark.parametrize("seeds", needs.the_first([range(1), range(1, 3)]), ids=str)
@pytest.mark.parametrize(
    "name", needs.the_first(["leg_damper", "joint", *sorted(set(FILES) - {"leg_damper", "joint"})], 2)
)
def test_the_derivatives_of_an_ending_are_those_of_differences(store, name, seeds):
    """Every entry of the matrix that has a difference."""
    solver = hopform.load_solver(name) if name == "hopper" else solver_of(store, FILES[name])
    seen, compared, missing = Counter[tuple[str, str]](), 0, 0
    for seed in seeds:
        for problem in coincidences(solver, name, Draw(f"{name} endings {seed}")):
            motion = solved(solver, problem)
            pair = pair_of(motion)
            matrix = motion.sensitivities.matrix
            if np.isnan(matrix[0]).all():
                missing += 1
                continue
            wrong, count = wrong_entries(solver, problem, motion)
            assert not wrong, (seed, pair, problem, wrong)
            compared += count
            seen[pair] += 1
    assert compared > 20 * len(seeds) * len(seen) and missing <= max(1.0, 0.05 * sum(seen.values()))
    assert set(seen) >= PULLED or name != "leg_damper"


# ---- a stop that takes the damper's force, through every door ----

START = {"x1": 0.0, "v1": 0.0, "v2": -1.0}
U = 3.0


@pytest.fixture(scope="module")
def pulled(store: Path) -> Any:
    """A leg_damper that its stop lifts off: N = k y + b_12 (v_1 - v_2) jumps below 0 as v_1 vanishes."""
    solver = solver_of(store, FILES["leg_damper"])
    hopper = hopform.load_robot("hopper_c")
    given = {field.name: getattr(hopper, field.name) for field in hopper.fields()}
    return solver.Robot(**given | {"b12": 100.0, "x1_max": 0.04})


def lifted(robot: Any, u: float = U, **options: Any) -> Any:
    return hopform.solve_stance(robot, u=u, **START, **options)


def test_a_take_off_at_a_stop_moves_with_the_stop(pulled):
    """By the current and the body's mass, in double and single precision, alone and among others."""
    stance = lifted(pulled)
    assert stance.status == "takeoff" and [event.kind for event in stance.events] == ["x2_reverses", "x1_hits_stop"]
    assert stance.events[-1].time == stance.duration
    h = 1e-5
    by_u = (lifted(pulled, U + h).apex - lifted(pulled, U - h).apex) / (2.0 * h)
    lighter, heavier = (lifted(dataclasses.replace(pulled, m_s=pulled.m_s + by)).apex for by in (-h, h))
    by_mass = (heavier - lighter) / (2.0 * h)
    assert by_u == pytest.approx(0.00099, abs=1e-5) and by_mass == pytest.approx(-0.0134, abs=1e-4)
    single = lifted(pulled, dtype="float32").sensitivities
    many = hopform.solve_stances(pulled, **START, u=[U, U], sensitivities=True).sensitivities
    for column, difference in (("u", by_u), ("m_s", by_mass)):
        assert stance.sensitivities["apex", column] == pytest.approx(difference, rel=1e-7)
        assert single["apex", column] == pytest.approx(difference, rel=1e-3)
        assert many["apex", column].tolist() == [stance.sensitivities["apex", column]] * 2


def test_a_candidate_current_whose_stance_a_stop_ends_has_the_same_slope(pulled, store):
    """Of the apex, by the controller's own variation, and of the contact force."""
    leg, h = Legs(store)["leg_damper"], 1e-5
    state, currents = leg.package.LegState(**START, y=0.0), np.linspace(2.2, 3.0, 5)
    below, at, above = (
        C(leg.library).try_currents(pulled.parameters, [state], u, 2.0, MOST)[0]
        for u in (currents - h, currents, currents + h)
    )
    for u, slope in zip(currents, at["apex_u"], strict=True):
        stance = lifted(pulled, float(u))
        assert stance.duration == stance.events[-1].time
        assert slope == pytest.approx(stance.sensitivities["apex", "u"], rel=1e-9)
    for name in ("apex", "least_contact"):
        np.testing.assert_allclose(at[f"{name}_u"], (above[name] - below[name]) / (2.0 * h), rtol=1e-6)
    assert at["takes_off"].all() and at["smooth"].all()


def test_a_take_off_at_a_stop_has_no_more_phases_than_are_allowed(pulled):
    """The phase of no duration that the impact begins is one of them."""
    whole = lifted(pulled)
    assert len(whole.phases) == 3 and lifted(pulled, max_phases=3) == whole
    fewer = lifted(pulled, max_phases=2)
    assert (fewer.status, len(fewer.phases)) == ("too_many_phases", 2)


def test_a_leg_that_pulls_from_the_start_ends_as_it_starts(pulled):
    """The state at the ending is that of the start, of which each velocity is an input, one that is held, too."""
    start = {"x1": 0.03, "v1": 0.0, "v2": 1.0, "compression": 0.01}
    stance = hopform.solve_stance(dataclasses.replace(pulled, f1=5.0), u=0.0, **start)
    assert (stance.status, stance.duration, stance.phases[0].mode_1) == ("takeoff", 0.0, 0)
    by = stance.sensitivities
    for row in ("T", "x1", "v1", "v2"):
        expected = [1.0 if row == column else 0.0 for column in by.columns]
        np.testing.assert_array_equal([by[row, column] for column in by.columns], expected)
    assert by["apex", "v2"] == pytest.approx(1.0 / pulled.g, rel=1e-14)
