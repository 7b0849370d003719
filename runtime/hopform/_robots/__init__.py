"""Robots: checked parameters, the shipped ones, TOML in and out, and where the numbers come from.

A number comes from a fit with its covariance, is known, or is another robot's. The table `[fit]` of a robot's TOML says
so; `Robot.sample` draws robots from it.
"""

import difflib
import math
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, make_dataclass, replace
from dataclasses import field as field_of_class
from functools import cache, cached_property, partial, partialmethod
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from hopform._checks import (
    MEMORY,
    MOST_DIGITS,
    Role,
    array_of,
    finite,
    flag,
    in_stroke,
    instance,
    items,
    real,
    refuse_any,
    shown,
    stream,
    whole,
)
from hopform._errors import HopformError, noted, printable
from hopform._files import name_of, path_of, read_text
from hopform._solver.choice import DEFAULT, SOLVERS, Solver
from hopform._solver.package import CheckedRobot, checked, not_loaded, records
from hopform._texts import key_of_toml, string_of_toml
from hopform._texts import line as comment


class Provenance(NamedTuple):
    """Fitted fields with values, ends of their 95 % intervals and covariance, all in SI units; which fields were known;
    the robot that gave the rest; whether the residuals were white; what it was made of: the version of hopform, the
    command, each file with its SHA-256, the delays that were fitted.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    known: tuple[str, ...]
    base: str
    white: bool
    origin: tuple[str, ...] = ()

    def of(self, name: str, value: float) -> str:
        """Where the value of a field comes from; a fitted one only as long as it is that of the fit."""
        if name in self.names:
            at = self.names.index(name)
            if self.values[at] == value and name not in self.with_interval():
                return "fitted, no interval"
            if self.values[at] == value:
                return f"fitted, 95 % {self.low[at]:.6g} .. {self.high[at]:.6g}"
            return f"changed after the fit, which gave {self.values[at]:.6g}"
        return "known" if name in self.known else f"from {self.base}, NOT IDENTIFIED"

    def with_interval(self) -> tuple[str, ...]:
        """The fitted fields that have an interval: those of a fit that left nothing unexplained."""
        ends = zip(self.names, self.low, self.high, strict=True)
        return tuple(name for name, low, high in ends if math.isfinite(low) and math.isfinite(high))

    def draw(
        self, count: int, draw: "np.random.Generator", fields: "tuple[records.Field, ...]"
    ) -> list[dict[str, float]]:
        """Values of the fitted fields, drawn from their joint distribution: normal; of logarithms for what is positive;
        friction below 0 counts as 0. fields: those of the robot.
        """
        domains = {field.name: field.domain for field in fields}
        values = np.array(self.values)
        log = np.array([domains[name] == "positive" for name in self.names], dtype=bool)
        slopes = np.where(log, values, 1.0)
        middle = np.where(log, np.log(np.where(log, values, 1.0)), values)
        covariance = np.array(self.covariance).reshape(values.size, values.size) / np.outer(slopes, slopes)
        drawn = draw.multivariate_normal(middle, covariance, count, method="eigh", check_valid="ignore")
        lowest = np.array([0.0 if domains[name] in ("nonnegative", "fraction") else -math.inf for name in self.names])
        drawn = np.maximum(np.where(log, np.exp(np.where(log, drawn, 0.0)), drawn), lowest)
        return [dict(zip(self.names, row, strict=True)) for row in drawn.tolist()]

    def to_toml(self) -> str:
        """The table `[fit]`."""
        lines = ["[fit]", "# 95 % intervals and covariance of what was fitted, in the units above"]
        for name, value in self._asdict().items():
            if name == "covariance":
                lines += [f"{name} = [", *(f"  {list(row)!r}," for row in self.covariance), "]"]
            else:
                lines.append(f"{name} = {_toml(value)}")
        return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        numbers: tuple[Any, ...] = value  # pyright: ignore[reportUnknownVariableType]
        return f"[{', '.join(map(_toml, numbers))}]"
    return string_of_toml(value) if isinstance(value, str) else repr(value)


def provenance_from(value: object, fields: "tuple[records.Field, ...]" = records.ROBOT_FIELDS) -> Provenance:
    """The provenance in a table `[fit]` of a robot with these fields; HopformError for one that is none."""
    table = cast(dict[str, Any], instance("fit", value, dict, "a table [fit]"))
    if table.keys() != set(Provenance._fields):
        raise HopformError(f"[fit] must have {', '.join(Provenance._fields)}, got {shown([*table])}")
    with noted("[fit] "):
        parameters = {field.name for field in fields}
        names, known = (_fields_in(name, table[name], parameters) for name in ("names", "known"))
        count = len(names)
        values, covariance = _array("values", table["values"], (count,)), table["covariance"]
        rows = _array("covariance", covariance, (count, count)) if count or covariance else values.reshape(0, 0)
        _refuse_no_covariance(rows)
        low, high = (_array(name, table[name], (count,), finite=False) for name in ("low", "high"))
        base, white = _text("base", table["base"]), flag("white", table["white"])
        numbers, lows, highs = (tuple(each.tolist()) for each in (values, low, high))
        origin = tuple(_text("origin", each) for each in items("origin", table["origin"], "texts", MOST_ORIGINS))
        return Provenance(names, numbers, lows, highs, tuple(map(tuple, rows.tolist())), known, base, white, origin)


KEYS = ("name", "model", "description", "fit", "parameters")
"""Keys of a robot's TOML that are no parameters: one of such a name stands in the table `[parameters]`."""
MOST_ORIGINS = 20_000
"""Texts that say what a fit was made of, at most: two of each recording."""


def _fields_in(name: str, value: object, parameters: set[str]) -> tuple[str, ...]:
    letters = items(name, value, "a list of parameters of the robot", len(parameters))
    if not all(isinstance(each, str) and each in parameters for each in letters) or len(set(letters)) < len(letters):
        raise HopformError(f"{name} must be parameters of the robot, each once, got {shown(letters)}")
    return tuple(letters)


def _refuse_no_covariance(rows: NDArray[Any]) -> None:
    spread = np.sqrt(np.maximum(np.diagonal(rows), 0.0))
    units = np.outer(spread, spread)
    correlation = np.divide(rows, units, out=np.where(rows == 0.0, 0.0, np.inf), where=units > 0.0)
    sound = np.isfinite(correlation).all() and np.allclose(correlation, correlation.T, atol=1e-6)
    if not sound or np.linalg.eigvalsh(correlation).min(initial=0.0) < -1e-6:
        raise HopformError(f"covariance must be symmetric and positive semidefinite, got {shown(rows.tolist())}")


def _array(name: str, value: object, shape: tuple[int, ...], *, finite: bool = True) -> NDArray[Any]:
    """Numbers in a shape; an end of an interval may be infinite."""
    try:
        numbers = np.array(value, dtype=object)
    except ValueError:
        numbers = np.array(None)
    if numbers.shape != shape:
        raise HopformError(f"{name} must be numbers of the shape {shape}, got {shown(value)}")
    array = array_of(name, numbers, "SI units") if numbers.size else numbers.astype(float)
    allowed = np.isfinite(array) if finite else ~np.isnan(array)
    refuse_any(name, array, allowed, lambda bad: f"must be a number, got {bad!r}")
    return array


LARGEST_TOML = 2**20
"""[B] the largest file of a robot."""
MOST_SAMPLES = MEMORY // 2**11
"""Robots of one sample."""
ROBOTS = ("hopper_c", "hopper_b", "ideal")
"""Names of the shipped robots. They are this project's own, not the paper's, which gives no values."""


def _text(key: str, text: object) -> str:
    """The text; HopformError for what is none, or none that a file can hold."""
    checked_text = instance(key, text, str, "a text")
    try:
        checked_text.encode()
    except UnicodeEncodeError:
        raise HopformError(f"{key} must be text that UTF-8 can encode, got {shown(text)}") from None
    return checked_text


def checked_value(field: records.Field, value: object) -> float:
    """The value of a parameter; HopformError for what is no number, or is out of its domain."""
    number = real(field.name, value, field.unit)
    if (reason := checked.refusal(field, number)) is not None:
        raise HopformError(reason)
    return number


def attribute_of(kind: "type[BaseRobot]", name: str) -> str:
    """The attribute and the argument that is a parameter of robots: `name_` where each of them has another `name`."""
    package = kind.solver.package
    return cast("dict[str, str]", package.checked.attributes(package.robot.Robot)).get(name, name)


@dataclass(frozen=True, kw_only=True)
class BaseRobot:
    """What the robots of every solver have: checks, a TOML text, robots that are drawn from a fit.

    The class of a solver's robots has the parameters of its equations from `robot.Robot` of its package, and names the
    solver. A robot is pickled as the source of its solver and its values.
    """

    travel: float = math.inf
    name: str = ""
    description: str = ""
    fit: Provenance | None = None
    """where the numbers come from, for a robot that was identified"""
    solver: ClassVar[Solver]
    CHECKS: ClassVar[Mapping[str, Callable[[object], object]]]
    """What a robot's fields but `fit` have to pass; each check returns the value as the robot keeps it."""

    def __new__(cls, *_: object, **values: object) -> Self:
        """HopformError for a name that is none of the robot's, which its __init__ would call a TypeError."""
        names = {
            *(each.name for each in fields(cast(Any, cls)) if each.init),
            *(each.name for each in cls.all_fields()),
        }
        if unknown := next((name for name in values if name not in names), None):
            raise HopformError(unknown_parameter(unknown, cls))
        return super().__new__(cls)

    def __init_subclass__(cls) -> None:
        cls.CHECKS = {
            **{attribute_of(cls, field.name): partial(checked_value, field) for field in cls.all_fields()},
            **{key: partial(_text, key) for key in ("name", "description")},
        }

    def __getitem__(self, name: str) -> float:
        """A parameter by its name, also where an attribute of this name is something else.

        >>> load_robot("hopper_c")["k"]
        1200.0
        """
        names = [field.name for field in self.all_fields()]
        if name not in names:
            raise HopformError(
                f"the model {self.solver.name} has no parameter {shown(name)}{nearest(str(name), names)}"
            )
        return cast(float, getattr(self, attribute_of(type(self), name)))

    def __post_init__(self) -> None:
        for name, check in self.CHECKS.items():
            object.__setattr__(self, name, check(getattr(self, name)))
        try:
            super().__post_init__()  # type: ignore[misc]
        except ValueError as error:
            raise HopformError(str(error)) from None

    def __reduce__(self) -> Any:
        values = {each.name: getattr(self, each.name) for each in fields(cast(Any, self)) if each.init}
        return _robot_again, (self.solver.source, values)

    @cached_property
    def letters(self) -> "records.Letters":
        """The letters of the derivation [SI, A] by this robot's parameters: the paper's, of every mechanism.

        >>> load_robot("hopper_c").letters.gamma2
        -65.0
        """
        letters: records.Letters = self.solver.package.formulas.letters_of(cast(Any, self).parameters)
        return letters

    @cached_property
    def fall(self) -> float:
        """Acceleration [m/s^2] with which the body falls in flight: g, less what constant forces pull at it.

        >>> load_robot("hopper_c").fall
        9.81
        """
        return self._of_contact("flight", "fall_of")

    @cached_property
    def standing_height(self) -> float:
        """Height [m] of the body on the unloaded leg at x1 = 0: where a hop height of 0 is.

        >>> load_robot("hopper_c").standing_height
        0.4
        """
        return float(self.letters.L0 + self.letters.c - self.compression_at_rest)

    def with_parameters(self, values: Mapping[str, float], **others: Any) -> Self:
        """The robot with other values of some parameters, by their names, and of other fields.

        >>> load_robot("hopper_c").with_parameters({"k": 1300.0}).k
        1300.0
        """
        given = {attribute_of(type(self), name): value for name, value in values.items()}
        return cast(Self, replace(cast(Any, self), **given, **others))

    @property
    def label(self) -> str:
        """Its name for a terminal; one made in Python may have none."""
        return printable(cast(str, cast(Any, self).name)) or "robot"

    @property
    def home(self) -> float:
        """Displacement of the actuator [m] at a drop: 0, or the end of its stroke next to it.

        >>> load_robot("hopper_c").home
        0.0
        """
        return float(min(max(0.0, self.letters.x1_min), self.letters.x1_max))

    @cached_property
    def compression_at_rest(self) -> float:
        """Compression of the spring [m] where that of the leg is 0.

        >>> load_robot("hopper_c").compression_at_rest
        0.0
        """
        return self._of_contact("stance", "compression_at_rest")

    def _of_contact(self, act: str, formula: str) -> float:
        """What a formula says that a model has for an act; HopformError where it lacks what that needs."""
        if act not in self.solver.can:
            raise self.solver.cannot(act)
        return float(getattr(self.solver.package.formulas, formula)(cast(Any, self).parameters))

    @classmethod
    def fields(cls) -> "tuple[records.Field, ...]":
        """The parameters of the equations: name, the paper's glyph, unit, domain, meaning, default."""
        return cast("tuple[records.Field, ...]", cls.solver.package.records.ROBOT_FIELDS)

    @classmethod
    def all_fields(cls) -> "tuple[records.Field, ...]":
        """The parameters, then what no equation knows."""
        return (*cls.fields(), *([cls.solver.package.records.TRAVEL] if "stance" in cls.solver.can else []))

    def to_toml(self) -> str:
        """The robot as a TOML text that `load_robot` reads back to the same robot, with the origin of each number if it
        was identified."""
        lines = [f"{key} = {string_of_toml(text)}" for key in ("name", "description") if (text := getattr(self, key))]
        apart = list[str]()
        for field in self.all_fields():
            number = self[field.name]
            origin = f"; {self.fit.of(field.name, number)}" if self.fit else ""
            line = f"{f'{key_of_toml(field.name)} = {number!r}':<24} # {comment(f'[{field.unit}] {field.meaning}{origin}')}"
            (apart if field.name in KEYS else lines).append(line)
        lines += ["", "[parameters]", *apart] if apart else []
        return "\n".join(lines) + "\n" + (f"\n{self.fit.to_toml()}" if self.fit else "")

    def sample(self, count: int, seed: int | None = None) -> "tuple[Any, ...]":
        """Robots drawn from the distribution of an identified robot's parameters; the same seed draws the same ones.

        A parameter that was changed after the fit keeps its value, as one without an interval does. count: at most
        `MOST_SAMPLES`. Raises HopformError for a robot that was not identified, or none of whose parameters has an
        interval.
        """
        if self.fit is None or not self.fit.names:
            raise HopformError(f"robot {self.name or 'given'} has no fit to draw from: identify one, or load its TOML")
        drawn_from = self.fit.with_interval()
        if not drawn_from:
            raise HopformError(
                f"robot {self.name or 'given'} has no intervals to draw from: its fit does not explain the recordings"
            )
        number = whole("count", count, 1, MOST_SAMPLES)
        draw = np.random.default_rng() if seed is None else stream(Role.ROBOTS, seed)
        values = zip(self.fit.names, self.fit.values, strict=True)
        kept = {name for name, own in values if name in drawn_from and self[name] == own}
        drawn = [{name: each[name] for name in kept} for each in self.fit.draw(number, draw, self.fields())]
        return tuple(self.with_parameters(each, fit=None) for each in drawn)


@dataclass(frozen=True, kw_only=True)
class Robot(BaseRobot, CheckedRobot):
    """What a hopper is made of, in SI units and A, checked at construction; fields as in `Robot.fields()`, and travel
    [m] of the spring, its compression at coil bind, beyond which a stance warns.

    Raises HopformError, which names the field, the value and what is allowed.

    >>> Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, f2=-1.0)
    Traceback (most recent call last):
    ...
    hopform._errors.HopformError: f2 must be >= 0 and finite m/s^2, got -1.0
    """

    solver: ClassVar[Solver] = DEFAULT


RobotKind = TypeVar("RobotKind", bound=BaseRobot)


def _initialised(robot: object, initialise: Callable[..., None], others: Mapping[str, str], /, **given: Any) -> None:
    """The constructor of a robot by arguments of which some have another name than their attribute."""
    initialise(robot, **{others.get(name, name): value for name, value in given.items()})


@cache
def robot_class(solver: Solver) -> type[Robot]:
    """The class of the robots of a solver."""
    if solver is DEFAULT:
        return Robot
    about = f"A robot of the model {solver.name}, in SI units, checked at construction."
    namespace = {"solver": solver, "__doc__": about, "__module__": __name__}
    bases = (BaseRobot, solver.package.robot.Robot)
    none = (
        [] if "stance" in solver.can else [("travel", float, field_of_class(default=math.inf, init=False, repr=False))]
    )
    robot: Any = make_dataclass("Robot", none, bases=bases, namespace=namespace, frozen=True, kw_only=True)
    arguments = {each.name for each in fields(robot)}
    others = {field.name: attribute_of(robot, field.name) for field in robot.fields() if field.name not in arguments}
    if others:  # the names of parameters that are attributes of every robot, as arguments
        robot.__init__ = partialmethod(_initialised, robot.__init__, others)
    return cast(type[Robot], robot)


def _robot_again(source: str, values: dict[str, Any]) -> BaseRobot:
    """The robot of a pickle; HopformError where its solver is not loaded."""
    if source not in SOLVERS:
        raise HopformError(not_loaded(f"robot {values['name'] or 'given'}", source))
    return robot_class(SOLVERS[source])(**values)


def checked_robot(robot: object, act: str = "motion", name: str = "robot") -> Robot:
    """The robot; HopformError for what is none, the name of one for instance, and for a robot whose model cannot do
    something, one of `ACTS`.
    """
    if not isinstance(robot, BaseRobot):
        raise HopformError(f"{name} must be a Robot, as load_robot gives it, got {shown(robot)}")
    if act not in robot.solver.can:
        raise robot.solver.cannot(act)
    return cast(Robot, robot)


def placed(robot: Robot, act: str, x1: Any, v1: Any, v2: Any) -> tuple[float, float, float]:
    """x1, v1, v2 as floats; HopformError for what is not finite, for an actuator beyond its stroke, and for a robot
    whose model cannot do what it starts.
    """
    checked_robot(robot, act)
    if type(x1) is type(v1) is type(v2) is float and math.isfinite(x1 + v1 + v2):  # the common case, all at once
        x_1, v_1, v_2 = x1, v1, v2
    else:
        x_1, v_1, v_2 = finite("x1", x1, "m"), finite("v1", v1, "m/s"), finite("v2", v2, "m/s")
    low, high = robot.letters.x1_min, robot.letters.x1_max
    if not low <= x_1 <= high:
        axis = robot.solver.facts.axes.get("x1", {"name": "x1", "unit": "m"})  # of a leg alone it never moves
        raise HopformError(f"{axis['name']} must be {in_stroke(low, high, axis['unit'])}, got {x_1!r}")
    return x_1, v_1, v_2


def falling_robot(robot: object, act: str, what: str, name: str = "robot") -> Robot:
    """The same of a robot whose body comes down again, which an act needs."""
    checked_one = checked_robot(robot, act, name)
    if not checked_one.fall > 0.0:
        raise HopformError(f"{what} needs g > 0 m/s^2, got {checked_one.fall!r}")
    return checked_one


def load_robot(name_or_path: str | Path) -> Robot:
    """A shipped robot by its name, or the robot of a TOML file whose keys are the names of parameters; those that are
    also a key of every robot, as `name`, stand in its table `[parameters]`.

    Raises HopformError: no such robot or file (with the nearest name), an unknown key (with the nearest known one),
    a value out of its domain (with file and line).

    >>> load_robot("hopper_c").k
    1200.0
    """
    return robot_of(Robot, name_or_path)


def shipped(kind: type[BaseRobot]) -> dict[str, Path]:
    """The robots that a solver has by name, the first one for whoever names none.

    A solver with other parameters than the hopper's has a robot in its folder. The hopper's robots are also those of
    every solver that hops and has their parameters.
    """
    of_hopper = {name: Path(str(resources.files("hopform._robots"))) / f"{name}.toml" for name in ROBOTS}
    here = {field.name for field in kind.fields()}
    fit = "hop" in kind.solver.can and {field.name for field in Robot.fields()} <= here
    if kind.fields() == Robot.fields() and fit:
        return of_hopper
    files = {}
    with suppress(HopformError):
        path = kind.solver.folder.path("robot.toml")
        name = _table(read_text(path, LARGEST_TOML), name_of(path)).get("name")
        files = {name if isinstance(name, str) and name else kind.solver.name: path}
    return files | (of_hopper if fit else {})


def robot_of(kind: type[RobotKind], name_or_path: str | Path) -> RobotKind:
    """The robot of a solver by its name, or of a TOML file; as `load_robot`."""
    path = robot_file(name_or_path, kind)
    if path is None:
        path = shipped(kind)[str(name_or_path)]
        return robot_from_toml(path.read_text("utf-8"), path.name, kind)
    if not os.path.exists(path):
        name, names = str(name_or_path), list(shipped(kind))
        if "/" in name or "\\" in name or name.endswith(".toml"):
            raise HopformError(f"there is no file {shown(name)}")
        close, expected = nearest(name, names), f"{', '.join(names)}, or a TOML file"
        raise HopformError(f"there is no robot {shown(name)}{f'{close} Known' if close else '; known'}: {expected}")
    return robot_from_toml(read_text(path, LARGEST_TOML), name_of(path), kind)


def robot_file(name_or_path: str | Path, kind: type[BaseRobot] = Robot) -> Path | None:
    """The file that `load_robot` reads; None for a robot that the solver has."""
    is_shipped = isinstance(name_or_path, str) and name_or_path in shipped(kind)
    return None if is_shipped else path_of("robot", name_or_path)


def robot_from_toml(text: str, source: str = "TOML", kind: type[RobotKind] = Robot) -> RobotKind:  # type: ignore[assignment]
    """The robot of a TOML text; `source` is what errors call it."""
    table = _table(text, source)
    with noted(after=f" ({source}, line {_line_of('model', text)})"):
        _refuse_another_model(table.pop("model", kind.solver.name), kind)
    names = {field.name: attribute_of(kind, field.name) for field in kind.all_fields()}
    keys = {name: attribute for name, attribute in names.items() if name not in KEYS}
    keys |= {key: key for key in ("name", "description", "fit")}
    checks: dict[str, Callable[[Any], Any]] = {**kind.CHECKS, "fit": partial(provenance_from, fields=kind.fields())}
    with noted(after=f" ({source}, line {_line_of('parameters', text)})"):
        apart = cast(dict[str, Any], instance("parameters", table.pop("parameters", {}), dict, "a table [parameters]"))
    given = dict[str, Any]()
    for field_of, part in ((keys, table), (names, apart)):
        for key, value in part.items():
            with noted(after=f" ({source}, line {_line_of(key, text)})"):
                if key not in field_of:
                    raise HopformError(unknown_parameter(key, kind))
                if field_of[key] in given:
                    raise HopformError(f"{key} is given twice")
                given[field_of[key]] = checks[field_of[key]](value)
    missing = [field.name for field in kind.fields() if field.default is None and names[field.name] not in given]
    if missing:
        raise HopformError(f"{source} lacks {', '.join(missing)}")
    with noted(after=f" ({source})"):
        return kind(**given)


def _refuse_another_model(model: object, kind: type[BaseRobot]) -> None:
    """HopformError for a robot of another model than the solver's."""
    if instance("model", model, str, "the name of a model") != kind.solver.name:
        raise HopformError(
            f"the robot is one of the model {shown(model)}, the solver is that of {shown(kind.solver.name)}"
        )


def _table(text: str, source: str) -> dict[str, Any]:
    """What a TOML text holds."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise HopformError(f"{source} is not valid TOML: {error}") from None
    except RecursionError:
        raise HopformError(f"{source} is not valid TOML for a robot: it is nested too deep") from None
    except ValueError:
        raise HopformError(f"{source} holds a whole number of more than {MOST_DIGITS} digits") from None


def _line_of(key: str, text: str) -> int:
    pattern = re.compile(rf"""^\s*["']?{re.escape(key)}["']?\s*[.=]|^\s*\[+\s*{re.escape(key)}""")
    return next((number for number, line in enumerate(text.splitlines(), 1) if pattern.match(line)), 1)


def unknown_parameter(name: str, kind: type[BaseRobot]) -> str:
    """What is said of a name that is none of a robot's."""
    names = [field.name for field in kind.all_fields()]
    close = nearest(name, [*names, "name"])
    return f"unknown parameter {shown(name)}{f'{close} Known' if close else '; known'}: {', '.join(names)}"


def nearest(word: str, words: list[str]) -> str:
    """A question about the known word that is nearest to one, nothing where none is near; one that differs by its case
    alone is the nearest.
    """
    same = [each for each in words if each.casefold() == word.casefold()]
    close = same or difflib.get_close_matches(word, words, 1, 0.5)
    return f", did you mean {close[0]!r}?" if close else ""
