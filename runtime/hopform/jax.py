"""Motions as functions of JAX: `jit`, `vmap`, `jvp`, `grad`, `jacfwd`, `jacrev`, by the solver's own derivatives.

    dy = sum over n of (d y/d x_n) dx_n

y is the ending of a motion, or its states at times. d y/d x_n are its exact derivatives, through every event; those
columns alone are computed that a transformation asks for. The rule is linear in dx, so that JAX transposes it for
reverse mode. What JAX has mapped by `vmap` is solved by one call of `solve_motions`.

    >>> import jax, hopform.jax
    >>> jax.config.update("jax_enable_x64", True)
    >>> joint = hopform.load_solver("joint")
    >>> end = hopform.jax.ending(joint.Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0)
    >>> x = {"b": 0.0085, "F_p": 0.042}
    >>> {name: round(float(slope), 4) for name, slope in jax.grad(lambda x: end(x).end.q)(x).items()}
    {'F_p': -215.7009, 'b': -1319.6991}

It needs the extra `jax`; MissingExtra says how to get it. Second derivatives are refused.
"""

import dataclasses
import math
import warnings
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from importlib import import_module
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._batch import Motions, named_columns, solve_motions
from hopform._broadcast import MOST_THREADS, check_names
from hopform._checks import mapping, numbers, positive, refuse_any, whole, word
from hopform._errors import HopformError
from hopform._motion import Motion, axes_by_name, input_unit, layout_of, precision_of, state_of_leg
from hopform._robots import Robot, checked_robot
from hopform._sensitivities import ManySensitivities
from hopform._show import needs
from hopform._solver.package import MAX_PHASES
from hopform._stance import solve_motion

Inputs = Mapping[str, Any]
"""What a motion is a function of, by name: numbers or arrays of JAX."""
Array = NDArray[np.floating]

__all__ = ["Ending", "ending", "states"]


class Ending(NamedTuple):
    """How a motion ended, in arrays of JAX, a pytree."""

    duration: Any
    """[s] time of the ending"""
    end: Any
    """the state there, a named tuple of the coordinates and velocities of the model, in its units"""
    apex: Any = None
    """[m] of a model with a contact, NaN without take-off; None of any other"""
    aed: Any = None
    """[J] change of the body's energy, of a model with a contact; None of any other"""


def ending(
    robot: Robot,
    *,
    start: Mapping[str, ArrayLike] | None = None,
    u: ArrayLike = 0.0,
    u_times: ArrayLike | None = None,
    horizon: float = 2.0,
    grazing: str = "nan",
    max_phases: int = MAX_PHASES,
    dtype: Any = np.float64,
    threads: int = 1,
) -> Callable[[Inputs], Ending]:
    """A function of JAX from inputs, by name, to the ending of the motion: its time and the state there.

    It takes a mapping of coordinates and velocities of the start, parameters of the robot and `u`, the input, to
    numbers; with u_times [s] `u` has a number for each of these times, from which on it holds, and the mapping may have
    `u_times`, too. What it leaves out is that of `start`, `robot`, `u` and `u_times` here. Many motions at once: `vmap`,
    which solves one by one those whose `u_times` differ. horizon [s] and max_phases: as for
    `solve_motions`. dtype: float64, for which JAX has to have `jax_enable_x64`, or float32. threads: how many solve at
    a time.

    Derivatives do not exist where an event grazes, where a rest ends at a small change, and where a search has ended.
    There they are NaN, with a RuntimeWarning when they are computed. grazing: "one-sided" gives, at such a rest, those of
    the state to the side on which it stays a rest. What is NaN itself, an apex without take-off, has derivatives 0, so
    that a loss which has `jnp.where` put something in its place has the derivative of the rest.

    Raises HopformError for a name that is no input, when the function is called or traced, and for second derivatives;
    MissingExtra without JAX. A value out of range raises the message of `solve_motions`, which within `jit` JAX wraps
    into an error of its own.
    """
    how = {"horizon": positive("horizon", horizon, "s"), "max_phases": max_phases, "dtype": dtype, "threads": threads}
    return _function(_problem(robot, start, u, u_times, None, grazing, how))


def states(
    robot: Robot,
    times: ArrayLike,
    *,
    start: Mapping[str, ArrayLike] | None = None,
    u: ArrayLike = 0.0,
    u_times: ArrayLike | None = None,
    grazing: str = "nan",
    max_phases: int = MAX_PHASES,
    dtype: Any = np.float64,
    threads: int = 1,
) -> Callable[[Inputs], Any]:
    """A function of JAX from inputs, by name, to the states at times [s]: a named tuple of coordinates and velocities,
    each an array over the times.

    Its argument, the other settings and the errors are those of `ending`. A rest holds its state. Behind a take-off,
    and where a search has ended, states are NaN and their derivatives 0.

    >>> import jax, jax.numpy as jnp, numpy as np, hopform
    >>> jax.config.update("jax_enable_x64", True)
    >>> joint, t = hopform.load_solver("joint"), np.arange(1, 9) / 60
    >>> course = states(joint.Robot(k=0.0), t, u_times=np.arange(8) / 60)
    >>> torque = jnp.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0, -1.0, 0.0])
    >>> course({"u": torque}).q.shape, jax.jacfwd(course)({"u": torque}).q["u"].shape
    ((8,), (8, 8))
    """
    t = numbers("times", times, "s")
    if t.ndim != 1 or not t.size:
        raise HopformError(f"times must be of one dimension, at least one, got shape {t.shape}")
    refuse_any("times", t, t >= 0.0, lambda bad: f"must be >= 0 s, got {bad!r}")
    how = {"times": t, "horizon": float(t.max()) or 1.0, "max_phases": max_phases, "dtype": dtype, "threads": threads}
    return _function(_problem(robot, start, u, u_times, t, grazing, how))


# ---- what is solved, in NumPy ----


@dataclass(frozen=True, eq=False)
class _Problem:
    """A motion that is solved, as the arguments of `solve_motions`, but for what the function of JAX takes."""

    robot: Robot
    start: Mapping[str, ArrayLike]
    u: Array
    times: Array | None
    how: Mapping[str, Any]
    one_sided: bool

    @cached_property
    def names(self) -> dict[str, str]:
        """What the function may take, each with where it belongs: the input has the name of the model's file, too."""
        facts = self.robot.solver.facts
        parameters = dict.fromkeys(self.robot.parameters._fields, "robot")
        inputs = {name: "input" for each in facts.inputs for name in ("u", str(each["name"]))}
        switches = {"u_times": "u_times"} if inputs and self.u.ndim else {}
        return parameters | inputs | switches | dict.fromkeys(axes_by_name(facts), "start")

    @cached_property
    def state(self) -> Any:
        """The named tuple of a state."""
        stands = "stance" in self.robot.solver.can
        return state_of_leg(self.robot.solver) if stands else layout_of(self.robot.solver).state

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """What is computed, as derivatives name it."""
        if self.times is not None:
            return tuple(self.state._fields)
        return ("T", *self.state._fields, *(("apex", "aed") if "stance" in self.robot.solver.can else ()))

    @property
    def shape(self) -> tuple[int, ...]:
        """That of a row."""
        return () if self.times is None else self.times.shape

    def result(self, rows: Sequence[Any]) -> Any:
        """The rows as the function gives them."""
        if self.times is not None:
            return self.state(*rows)
        count = 1 + len(self.state._fields)
        return Ending(rows[0], self.state(*rows[1:count]), *rows[count:])

    def shape_of(self, name: str) -> tuple[int, ...]:
        """That of what the function takes: a number, or of the input and its times one for each step."""
        return self.u.shape if self.names[name] in ("input", "u_times") else ()

    def columns_by(self, name: str) -> list[str]:
        """The columns of derivatives by what the function takes; "" by the time of the first step, which is 0."""
        if not self.shape_of(name):
            return [name]
        of = "t" if name == "u_times" else "u"
        return [f"{of}[{n}]" if n or of == "u" else "" for n in range(self.u.size)]

    def inputs(self, x: object) -> dict[str, Any]:
        """What a function is called with, in the order of names; HopformError for a name that is no input, for one that
        is there twice, and for a shape that does not fit."""
        values = mapping("x", x, len(self.names))
        inputs = [name for name, place in self.names.items() if place != "robot"]
        check_names(map(str, values), self.names, "motion", inputs)
        drives = sorted(name for name in values if self.names[name] == "input")
        if len(drives) > 1:
            raise HopformError(f"give the input once, got it as {' and as '.join(drives)}")
        for name, value in values.items():
            shape = self.shape_of(name)
            if np.shape(value) != shape:
                what = f"an array of shape {shape}, a number for each of u_times" if shape else "a number"
                raise HopformError(f"{name} must be {what}; vmap maps it over many; got shape {np.shape(value)}")
        return {name: values[name] for name in sorted(values)}

    def solve(self, given: "_Given", by: Sequence[str]) -> list[Array]:
        """The rows, each (*batch, *shape), where that is more than one number of all; behind them the derivatives of each
        by `by`, (*batch, *shape, columns), if it names something.
        """
        every = [column for name in by for column in self.columns_by(name)]
        columns = [column for column in every if column]
        found = solve_motions(
            self.robot, start=given.start, u=given.u, sensitivities=columns or False, **given.how, **given.fields
        )
        if found.states is not None:
            rows = [*found.states]
        else:
            ends = {"T": found.duration, **found.end._asdict()}
            rows = [ends[row] if row in ends else getattr(found, row) for row in self.rows]
        if not every:
            return rows
        matrices = (
            self.derivatives(found, rows, given, columns) if columns else [np.zeros((*row.shape, 0)) for row in rows]
        )
        first = [n - every[:n].count("") for n, column in enumerate(every) if not column]
        return [*rows, *(np.insert(matrix, first, 0.0, axis=-1) for matrix in matrices)]

    def derivatives(
        self, found: Motions, rows: Sequence[Array], given: "_Given", columns: Sequence[str]
    ) -> list[Array]:  # fmt: skip
        """The derivatives of the rows by columns, NaN where there are none; 0 where a row is NaN itself."""
        ends = cast(ManySensitivities, found.sensitivities)
        of = ends if found.state_sensitivities is None else found.state_sensitivities
        zero = np.zeros((*rows[0].shape, len(columns)), of.matrix.dtype)
        matrices = [of.matrix[..., of.rows.index(row), :].copy() if row in of.rows else zero for row in self.rows]
        in_range = found.status >= 0
        without = np.isnan(ends.matrix[..., ends.rows.index("T"), 0]) & in_range
        if without.any():
            how = "NaN, or at a rest those to one side" if self.one_sided else "NaN"
            count = f"{int(without.sum())} of {without.size}"
            warnings.warn(
                f"hopform.jax: derivatives do not exist in {count} motions: {how}", RuntimeWarning, stacklevel=2
            )
        for index in np.argwhere(without & (self.one_sided or self.times is not None)):
            place = tuple(index.tolist())
            for matrix, values in zip(matrices, self.near(given, place, columns), strict=True):
                matrix[place] = values
        for matrix, row in zip(matrices, rows, strict=True):
            matrix[np.isnan(row) & in_range.reshape((*in_range.shape, *[1] * len(self.shape)))] = 0.0
        return matrices

    def near(self, given: "_Given", place: tuple[int, ...], columns: Sequence[str]) -> list[Array]:
        """The derivatives of the rows of one motion that has none at its ending, as far as they are known."""
        solve = partial(_solved_again, self.robot, given, place)
        motion = solve(given.how["horizon"])
        until = _known_until(solve, motion, self.one_sided)
        t = np.atleast_1d(motion.duration if self.times is None else self.times)
        goes_on = motion.status in ("rest", "horizon")
        known = (t < until) & (goes_on if self.times is None else (t <= motion.duration) | (motion.status == "rest"))
        rows = {row: np.full((t.size, len(columns)), np.nan) for row in self.rows}
        if known.any():
            of = motion.derivatives(t[known], by=columns)
            for row in of.rows:
                rows[row][known] = of.matrix[:, of.rows.index(row)]
            if motion.status == "horizon" and "T" in rows:
                rows["T"][:] = 0.0
        return [values[0] if self.times is None else values for values in rows.values()]


class _Given(NamedTuple):
    """What motions start from and the robots, as arrays over a batch."""

    batch: tuple[int, ...]
    start: Mapping[str, Any]
    u: Any
    """(*batch, steps), without that axis if there are none"""
    fields: Mapping[str, Any]
    how: Mapping[str, Any]
    """further arguments of `solve_motions`"""


def _solved_again(robot: Robot, given: _Given, place: tuple[int, ...], horizon: float) -> Motion:
    """One motion of a batch, up to a horizon."""

    def here(x: Any, steps: tuple[int, ...] = ()) -> Any:
        return np.broadcast_to(x, (*given.batch, *steps))[place]

    fields: dict[str, Any] = {name: float(here(x)) for name, x in given.fields.items()}
    one = dataclasses.replace(robot, **fields)
    how, start = given.how, {name: float(here(x)) for name, x in given.start.items()}
    t = how.get("u_times")
    u = float(here(given.u)) if t is None else [*zip(t.tolist(), here(given.u, t.shape).tolist(), strict=True)]
    return solve_motion(
        one, start=start, u=u, horizon=horizon, max_phases=how["max_phases"], dtype=how["dtype"]
    )  # fmt: skip


def _known_until(solve: Callable[[float], Motion], motion: Motion, one_sided: bool) -> float:
    """The time from which on the derivatives of a motion, which its ending does not have, are not known.

    They are missing at an ending between events if one before it grazes: behind that one they are of no use. Else it is
    the ending that lacks them; at a rest that a small change ends, those to the side on which it stays one are those of
    a motion that rests, if friction leaves room for it.
    """
    ends = [0.0, *(event.time for event in motion.events), motion.duration]
    between = [(begin, end) for begin, end in pairwise(ends) if begin < end]

    def behind_a_graze(bounds: tuple[float, float]) -> bool:
        return bool(np.isnan(solve(0.5 * sum(bounds)).sensitivities.matrix[0, 0]))

    first = bisect_left(between, True, key=behind_a_graze)
    if first < len(between):
        return between[first][0]
    if motion.status != "rest":
        return math.inf
    package = motion.robot.solver.package
    levels = package.formulas.friction_of(motion.robot.parameters)
    stays = all(levels[element] > 0.0 for element in package.elements.MOVING)
    return math.inf if one_sided and stays else motion.duration


def _problem(
    robot: Robot, start: Mapping[str, ArrayLike] | None, u: ArrayLike, u_times: ArrayLike | None, times: Array | None,
    grazing: str, how: dict[str, Any],
) -> _Problem:  # fmt: skip
    """A motion to be solved; HopformError for what is not allowed."""
    units = checked_robot(robot).solver.facts.units
    named_columns(robot, start)
    begin = {name: numbers(f"start {name}", value, units[name]) for name, value in dict(start or {}).items()}
    for name, value in begin.items():
        if value.ndim:
            raise HopformError(f"start {name} must be a number, got shape {value.shape}; vmap maps it over many")
    current = numbers("u", u, input_unit(robot.solver))
    if u_times is None and current.ndim:
        raise HopformError(f"u must be a number, or with u_times one for each step, got shape {current.shape}")
    if u_times is not None:
        how["u_times"] = t = numbers("u_times", u_times, "s").reshape(-1)
        refuse_any(
            "u_times", t, (np.arange(t.size) > 0) | (t == 0.0), lambda bad: f"must be 0 s, where u begins, got {bad!r}"
        )
        refuse_any(
            "u_times", t, np.append(True, np.diff(t) > 0.0), lambda bad: f"must be > the one before, got {bad!r} s"
        )
        if current.ndim and current.shape != t.shape:
            raise HopformError(f"u must have a number for each of {t.size} u_times, got shape {current.shape}")
        current = np.broadcast_to(current, t.shape)
    word("grazing", grazing, ("nan", "one-sided"))
    whole("max_phases", how["max_phases"])
    whole("threads", how["threads"], most=MOST_THREADS)
    how["dtype"] = precision_of(how["dtype"])
    return _Problem(robot, begin, current, times, how, grazing == "one-sided")


# ---- what JAX maps, compiles and differentiates ----


def _function(problem: _Problem) -> Callable[[Inputs], Any]:
    """A problem as a function of JAX."""
    jax: Any = needs("jax", "jax", "hopform.jax")
    dtype = problem.how["dtype"]

    @cache
    def of(names: tuple[str, ...]) -> Any:
        return _differentiable(problem, names)

    def function(x: Inputs) -> Any:
        if dtype == np.float64 != jax.numpy.result_type(float):
            raise HopformError(
                'dtype float64 needs jax.config.update("jax_enable_x64", True); without it give dtype="float32"'
            )
        values = problem.inputs(x)
        return problem.result(of(tuple(values))(*(jax.numpy.asarray(each, dtype) for each in values.values())))

    return function


def _differentiable(problem: _Problem, names: tuple[str, ...]) -> Any:
    """The rows of a problem as a function of arrays, one for each name, with the rule by which they change."""
    jax: Any = import_module("jax")
    count = len(problem.rows)

    @cache
    def derivatives(by: tuple[str, ...]) -> Any:
        """Rows and their derivatives by some names; these have no derivatives."""
        call = _Call(problem, names, by)

        def solved(*values: Any) -> Any:
            return _primitive().bind(*values, call=call)

        def refused(values: Any, tangents: Any) -> Any:
            raise HopformError(
                "hopform.jax has first derivatives alone: this transformation asks for second ones, as jax.hessian does"
            )

        function = jax.custom_jvp(solved)
        function.defjvp(refused)
        return function

    def solved(*values: Any) -> Any:
        return derivatives(())(*values)

    def rule(values: Any, tangents: Any) -> Any:
        none = jax.custom_derivatives.SymbolicZero
        moved = {name: dx for name, dx in zip(names, tangents, strict=True) if not isinstance(dx, none)}
        answer = derivatives(tuple(moved))(*values)
        dx = jax.numpy.concatenate([jax.numpy.reshape(each, -1) for each in moved.values()])
        return answer[:count], [jax.numpy.matmul(matrix, dx, precision="highest") for matrix in answer[count:]]

    function = jax.custom_jvp(solved)
    function.defjvp(rule, symbolic_zeros=True)
    return function


@dataclass(frozen=True, eq=False)
class _Call:
    """What the primitive calls: a problem as a function of the values of names, with derivatives by some of them."""

    problem: _Problem
    names: tuple[str, ...]
    by: tuple[str, ...]

    def shapes(self, batch: tuple[int, ...]) -> list[tuple[int, ...]]:
        """Those of its answer."""
        shape, count = (*batch, *self.problem.shape), len(self.problem.rows)
        columns = sum(len(self.problem.columns_by(name)) for name in self.by)
        return [shape] * count + [(*shape, columns)] * (count if self.by else 0)

    def batch(self, shapes: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
        """The axes that `vmap` has put before those of values in these shapes."""
        axes = [len(self.problem.shape_of(name)) for name in self.names]
        return np.broadcast_shapes(*(shape[: len(shape) - own] for shape, own in zip(shapes, axes, strict=True)))

    def __call__(self, *values: Any) -> tuple[Array, ...]:
        batch = self.batch([np.shape(x) for x in values])
        of: dict[str, dict[str, Array]] = {place: {} for place in ("start", "input", "u_times", "robot")}
        for name, x in zip(self.names, values, strict=True):
            of[self.problem.names[name]][name] = np.asarray(x)
        start, u = {**self.problem.start, **of["start"]}, next(iter(of["input"].values()), self.problem.u)
        how = self.problem.how
        for t in of["u_times"].values():
            each = t.reshape(-1, t.shape[-1])
            if (each != each[:1]).any():
                return self.one_by_one(batch, values)
            how = {**how, "u_times": each[0]} if each.size else how
        answer = self.problem.solve(_Given(batch, start, u, of["robot"], how), self.by)
        return tuple(map(np.broadcast_to, answer, self.shapes(batch)))

    def one_by_one(self, batch: tuple[int, ...], values: Sequence[Any]) -> tuple[Array, ...]:
        """The same of motions whose steps have other times: a call has one list of them."""
        each = [
            np.broadcast_to(x, (*batch, *self.problem.shape_of(name)))
            for name, x in zip(self.names, values, strict=True)
        ]
        alone = [self(*(x[place] for x in each)) for place in np.ndindex(*batch)]
        return tuple(
            np.reshape(rows, shape) for rows, shape in zip(zip(*alone, strict=True), self.shapes(batch), strict=True)
        )


@cache
def _primitive() -> Any:
    """The primitive of JAX that calls NumPy: one call for what `vmap` maps.

    `jax.pure_callback` hands arrays of JAX to what it calls. On a machine of one core that waits for ever, for values
    that the thread brings which waits. Here NumPy's views of them are handed over.
    """
    jax_numpy, core = import_module("jax.numpy"), import_module("jax.core")
    batching, mlir = import_module("jax.interpreters.batching"), import_module("jax.interpreters.mlir")
    primitive = import_module("jax.extend.core").Primitive("hopform_motions")
    primitive.multiple_results = True

    def evaluated(*values: Any, call: _Call) -> Any:
        return [jax_numpy.asarray(each) for each in call(*values)]

    def abstract(*values: Any, call: _Call) -> Any:
        shapes = call.shapes(call.batch([each.shape for each in values]))
        return [core.ShapedArray(shape, call.problem.how["dtype"]) for shape in shapes]

    def mapped(values: Any, axes: Any, *, call: _Call) -> Any:
        first = [
            jax_numpy.expand_dims(x, 0) if axis is None else jax_numpy.moveaxis(x, axis, 0)
            for x, axis in zip(values, axes, strict=True)
        ]
        answer = primitive.bind(*first, call=call)
        return answer, [0] * len(answer)

    def lowered(context: Any, *values: Any, call: _Call) -> Any:
        given, results = context.avals_in, context.avals_out
        return mlir.emit_python_callback(context, call, None, [*values], given, results, has_side_effect=False)[0]

    primitive.def_impl(evaluated)
    primitive.def_abstract_eval(abstract)
    batching.primitive_batchers[primitive] = mapped
    mlir.register_lowering(primitive, lowered)
    return primitive
