"""`hopform model prove`: the proofs of a model, and its C and its NumPy."""

import math
import random
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

import numpy as np
import typer

import hopform
from hopform import HopformError
from hopform import model as door
from hopform._building import in_one_line, no_compiler, readable, solver_of
from hopform._cli.output import deliver, table, to_json
from hopform._errors import printable
from hopform._progress import progress_bar
from hopform._robots import attribute_of
from hopform._solver.c import made_plan
from hopform._solver.choice import DEFAULT, Solver
from hopform._solver.loading import loaded

IN_C_AND_NUMPY = "C = NumPy = exact: {}, in units in the last place"
MOST_ULP = 64.0
"""A phase is held to mixed stability: its result is within 32 units in the last place of the exact result of a phase whose
inputs were moved by 32 at most. That is 64 units of the result's size and of what all inputs, moved by one, do to it.
"""
EPS = 2.0**-52
TIME_CONSTANTS = 10.0
"""How long a motion is followed; it is read in the middle of its first phase."""


def model_prove(model: str, json: bool = False) -> None:
    """Prove the formulas of a model.

    It checks identities by algebra, each formula at 40 digits against the elements of the file, and the compiled library
    against NumPy, for random robots and for those at the edges of their domains. Exit code 1 if a check fails: the table
    names the formula and the robot. This runs the file as Python: read it first.
    """
    prove = proofs()
    with in_one_line():
        derivation, draft = prove.source(readable(model))
        drawn = prove.robots(derivation)
    with progress_bar("proving") as bar:
        checks = [*prove.identities(derivation, draft), *prove.numbers(derivation, draft, drawn)]
        own = DEFAULT if model == DEFAULT.name else loaded(solver_of(readable(model), None, bar).folder)
        checks += c_against_numpy(own, derivation, draft, drawn)
    warnings = [] if checks[-1].count else [f"{checks[-1].what}: {checks[-1].where}"]
    robots = [{"name": each.name, "parameters": each.values} for each in drawn]
    rows: list[dict[str, Any]] = [{"verdict": verdict(each), **vars(each)} for each in checks]
    text = to_json("model prove", model=derivation.model.name, robots=robots, checks=rows) if json else ""
    deliver((), warnings, text, lambda: (table_of(derivation.model, checks, len(drawn)),))
    if any(verdict(each) == "fails" for each in checks):
        raise typer.Exit(1)


def proofs() -> Any:
    """The part of the derivation that proves; its names are those of its `__all__`."""
    return door.part("prove")


def verdict(check: Any) -> str:
    """In a word; what compared nothing proves nothing, but without a library there is nothing to compare."""
    if check.count == 0 and check.error == 0.0:
        return "left out"
    return "holds" if check.holds else "fails"


def table_of(model: Any, checks: Sequence[Any], count: int) -> Any:
    """A row for each check; errors of identities are how many fail."""
    rows = [
        (printable(each.what), str(each.count), f"{each.error:.1e}", f"{each.bound:g}", verdict(each),
         printable(each.where) if not each.holds or each.error else "")
        for each in checks
    ]  # fmt: skip
    title = printable(f"{model.name}: {model.title} {count} robots")
    return table(title, ("check", "compared", "worst error", "bound", "verdict", "where"), rows,
                 ("check", "verdict", "where"))  # fmt: skip


# ---- C = NumPy ----


def c_against_numpy(solver: Solver, derivation: Any, draft: Any, drawn: Sequence[Any]) -> Iterator[Any]:
    """Plan and motion of the compiled library and of the generated NumPy against exact ones, a row each."""
    prove = proofs()
    if not solver.folder.library.is_file():
        why = f"there is no library: {no_compiler()}"
        yield prove.Check(IN_C_AND_NUMPY.format("plan and motion"), 0, 0.0, MOST_ULP, why)
        return
    pair, found = Pair(solver, derivation, draft), dict[str, list[tuple[float, str]]]()
    generator = random.Random(3)
    for robot in drawn:
        for group, name, error in pair.errors(robot, generator):
            found.setdefault(group, []).append((error, f"{name} of {robot.name}"))
    for group in ("plan", "motion"):
        error, where = max(found.get(group, [(math.inf, pair.refused or "none of the robots moves")]))
        yield prove.Check(IN_C_AND_NUMPY.format(group), len(found.get(group, ())), error, MOST_ULP, where)


class Pair:
    """The compiled library of a solver and its NumPy, which solve the same motions."""

    def __init__(self, solver: Solver, derivation: Any, draft: Any) -> None:
        self.prove, self.model = proofs(), derivation.model
        self.solver, package = hopform.Solver(solver), solver.package.name
        self.numpy, self.records = import_module(f"{package}.solver"), import_module(f"{package}.records")
        self.types = solver.compiled().library.types(np.dtype(np.float64))
        self.mechanics = self.prove.Mechanics(self.model, draft)
        self.refused = ""

    def errors(self, robot: Any, generator: random.Random) -> Iterator[tuple[str, str, float]]:
        """Of plan and motion by the name of each number: the larger error of both, in units in the last place."""
        known = self.prove.situation(self.mechanics, robot, generator)
        start, u = self.start(known), self.input(known)
        attributes = {attribute_of(self.solver.Robot, name): value for name, value in robot.values.items()}
        try:
            checked = self.solver.Robot(**attributes)
            motion = self.solver.solve_motion(checked, start=start, u=u, horizon=self.horizon(known))
        except HopformError as error:  # say a coefficient beyond the range of floats
            self.refused = f"{robot.name}: {error}"
            return
        same = self.numpy.solve(self.records.Robot(*robot.values.values()), start, u, self.horizon(known))
        if not motion.phases or not same.phases or motion.phases[0][2:4] != same.phases[0][2:4]:
            yield "motion", "the mode of the first phase", math.inf
            return
        phase = motion.phases[0]
        sides = phase.mode_1, phase.mode_2
        moving = tuple(n for n in self.model.moving if sides[n - 1])
        t = min(phase.end, same.phases[0].end) / 2
        if not moving or t == 0.0:
            return
        known |= self.situation_of(known, phase, t, sides)
        follows = self.model.has_law and phase.mode_2 == 0
        exact = self.prove.exactly(self.prove.Own(self.mechanics, moving, known, follows=follows))
        plan = made_plan(self.types, tuple(robot.values.values()))[0]
        form = self.form(phase)
        factors = self.factors(self.records.Robot(*robot.values.values()), form, follows)
        of_forms = plan.poles if hasattr(plan.poles, "__len__") else [plan.poles]  # of one mode they are no array
        poles = of_forms[len(self.numpy.MODES) if follows else form]
        for name in ("a", "p", "q"):
            yield "plan", name, _ulps(getattr(poles, name), getattr(factors, name), exact[name])
        for key, name in self.names(moving).items():
            yield "motion", name, _ulps(getattr(motion.at(t), name), getattr(same.at(t), name), exact[f"{key}_t"])

    def form(self, phase: Any) -> int:
        """Which of the modes a phase is in; a plan has their poles in this order, and those under a law behind them."""
        slips = self.numpy.slipping((phase.mode_1, phase.mode_2))
        return next(n for n, mode in enumerate(self.numpy.MODES) if mode.slips == slips)

    def factors(self, robot: Any, form: int, follows: bool) -> Any:
        """The poles of a mode in NumPy."""
        polynomial = self.numpy.MODES[form].polynomial
        rates = (self.numpy.formulas.rates_under_law if follows else self.numpy.formulas.rates_of)(robot)
        return self.numpy.factors_of([rates[n] for n in polynomial])

    def names(self, moving: tuple[int, ...]) -> dict[str, str]:
        """The coordinates and velocities of the masses that slip, as the model calls them."""
        own = {n: self.model.names[n - 1] for n in moving}
        return {f"x{n}": each.coordinate for n, each in own.items()} | {
            f"v{n}": each.velocity for n, each in own.items()
        }

    def start(self, known: Any) -> dict[str, float]:
        """A start: between stops, and on a leg that is compressed and falls."""
        found = dict[str, float]()
        for n, own in enumerate(self.model.names, 1):
            if own is not None:
                found[own.coordinate] = 0.0 if n == 1 else float(known[self.mechanics.inputs["x2_0"].name])
                found[own.velocity] = float(known[self.mechanics.inputs[f"v{n}_0"].name])
        if self.model.has_contact:
            length = float(self.prove.number(self.mechanics.length, known))
            fall = abs(found[self.model.names[1].velocity])
            found |= {self.model.names[1].coordinate: length - 0.02, self.model.names[1].velocity: -fall}
            if self.model.names[0] is not None:
                found[self.model.names[0].velocity] = fall
        return found

    def input(self, known: Any) -> float:
        key = "target" if self.model.has_law else "u"
        return float(known[self.mechanics.inputs[key].name]) if self.model.input is not None else 0.0

    def horizon(self, known: Any) -> float:
        """Some time constants of the motion in which nothing is held."""
        return TIME_CONSTANTS / float(self.prove.Own(self.mechanics, self.model.moving, known).rate)

    def situation_of(self, known: Any, phase: Any, t: float, sides: Sequence[int]) -> dict[str, Any]:
        """The start of a phase, its time and input, by the names of formulas."""
        inputs, found = self.mechanics.inputs, {self.mechanics.inputs["t"].name: t}
        for n, own in enumerate(self.model.names, 1):
            if own is not None:
                found[inputs[f"x{n}_0"].name] = getattr(phase.state, own.coordinate)
                found[inputs[f"v{n}_0"].name] = getattr(phase.state, own.velocity)
                found[inputs[f"side_{n}"].name] = sides[n - 1]
        if self.model.input is not None:
            found[inputs["target" if self.model.has_law else "u"].name] = phase.u
        if self.model.has_law:  # at a limit the current is that
            found[inputs["u"].name] = phase.mode_2 * self.prove.number(self.mechanics.limit, known)
        return {name: self.prove.exact(value) for name, value in found.items()}


def _ulps(one: float, other: float, exact: Any) -> float:
    """The larger error of two numbers, in units in the last place of the result and of what all inputs move it by."""
    error, size = max(abs(one - exact.value), abs(other - exact.value)), abs(exact.value) + exact.condition
    return 0.0 if error == 0.0 else error / (EPS * size) if size else math.inf
