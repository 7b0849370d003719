"""A model file as a problem of tests/oracle/mechanism: what its elements say, as formulas of its parameters.

The start is that of the library, (x1, v1, v2, y) without what the model lacks; y is defined by a text in the
coordinates, as the header of the library says it.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.oracle.elements import Row, elements


class Formula:
    """A formula in text, put together as a file does it with numbers; its decimals are inputs of their own."""

    def __init__(self, text: str, numbers: dict[str, float]) -> None:
        self.text, self.numbers = text, numbers

    def of(self, value: Any) -> str:
        if isinstance(value, Formula):
            return value.text
        if isinstance(value, float) and value not in (float("inf"), -float("inf")):
            name = next((name for name, known in self.numbers.items() if known == value), f"number_{len(self.numbers)}")
            self.numbers[name] = value
            return name
        return f"({value})"

    def with_other(self, form: str, other: Any) -> Any:
        if isinstance(other, Row):
            return NotImplemented
        return Formula(form.format(self.text, self.of(other)), self.numbers)

    def __neg__(self) -> "Formula":
        return Formula(f"(-{self.text})", self.numbers)

    def __add__(self, other: Any) -> Any:
        return self.with_other("({} + {})", other)

    def __radd__(self, other: Any) -> Any:
        return self.with_other("({1} + {0})", other)

    def __sub__(self, other: Any) -> Any:
        return self.with_other("({} - {})", other)

    def __rsub__(self, other: Any) -> Any:
        return self.with_other("({1} - {0})", other)

    def __mul__(self, other: Any) -> Any:
        return self.with_other("{}*{}", other)

    def __rmul__(self, other: Any) -> Any:
        return self.with_other("{1}*{0}", other)

    def __truediv__(self, other: Any) -> Any:
        return self.with_other("({}/({}))", other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.with_other("({1}/({0}))", other)

    def __pow__(self, power: int) -> "Formula":
        return Formula(f"({self.text})**{power}", self.numbers)


def total(terms: Sequence[Any], numbers: dict[str, float]) -> str:
    """A sum in text; terms that are 0 are left out."""
    texts = [Formula("", numbers).of(term) for term in terms if isinstance(term, Formula) or term]
    return " + ".join(texts) or "0"


class Equations:
    """The equations of a file as the fields of a problem, its robot and start apart."""

    def __init__(self, file: Path, names: Sequence[str], stretch: str, second_alone: bool) -> None:
        """names: the parameters; stretch: y in the coordinates; second_alone: whether it is mass 2 that moves alone."""
        self.numbers: dict[str, float] = {}
        self.of = of = elements(file, {name: Formula(name, self.numbers) for name in names})
        self.moving, size = of.moving, range(len(of.moving))
        self.axes = ["v2", "y"] if second_alone else ["x1", "v1"] if len(self.moving) == 1 else ["x1", "v1", "v2", "y"]
        inertias = [self.sum([of.coordinates[name][1]]) for name in self.moving]
        self.text: dict[str, Any] = {
            "name": file.stem,
            "coordinates": self.moving,
            "mass": [[inertia if i == j else "0" for j in size] for i, inertia in enumerate(inertias)],
            "stiffness": self.matrix(of.springs),
            "damping": self.matrix(of.dampers),
            "force": [self.sum(self.forces(name)) for name in self.moving],
            "input": [self.sum([row.by.get(of.input, 0) for on, row in of.forces if on == n]) for n in self.moving],
            "elements": [self.element(n, name) for n, name in enumerate(self.moving)],
            **self.ends(),
            **self.state(stretch),
        }  # fmt: skip

    def sum(self, terms: Sequence[Any]) -> str:
        return total(terms, self.numbers)

    def matrix(self, parts: Sequence[tuple[Row, Any]]) -> list[list[str]]:
        rows = [(self.of.along(on), value) for on, value in parts]
        size = range(len(self.moving))
        return [
            [self.sum([value * by[i] * by[j] for by, value in rows if nonzero(by[i], by[j])]) for j in size]
            for i in size
        ]

    def forces(self, name: str) -> list[Any]:
        """Constant forces on a coordinate, those of its springs among them."""
        n, of = self.moving.index(name), self.of
        springs = [
            -(value * on.by[""]) * of.along(on)[n]
            for on, value in of.springs
            if nonzero(on.by.get("", 0), of.along(on)[n])
        ]
        return [*springs, *(row.by[""] for on, row in of.forces if on == name and nonzero(row.by.get("", 0)))]

    def element(self, n: int, name: str) -> dict[str, Any]:
        of, write = self.of, Formula("", self.numbers).of
        slides, rests = of.friction.get(name, ((0, 0), (0, 0)))
        low, high = of.stops.get(name, (-float("inf"), float("inf")))
        return {
            "name": name,
            "direction": [int(i == n) for i in range(len(self.moving))],
            "friction": [write(each) for each in slides],
            "at_rest": [write(each) for each in rests],
            "limits": [self.limit(each) for each in (low, high)],
        }

    def limit(self, value: Any) -> str:
        """A stop; what a file says by a number is an input, too, because a start at the stop moves with it."""
        is_number = not isinstance(value, Formula) and abs(value) != float("inf")
        return Formula("", self.numbers).of(float(value) if is_number else value)

    def ends(self) -> dict[str, Any]:
        """The contact and the law."""
        of, size, found = self.of, range(len(self.moving)), dict[str, Any]()
        if of.stands:
            leg = [(on, value) for on, value in of.springs if of.in_leg(on)]
            pads = [(on, value) for on, value in of.dampers if of.in_leg(on)]
            lifts = [[-(value * of.along(on)[-1]) * of.along(on)[j] for on, value in leg] for j in size]
            slows = [[-(value * of.along(on)[-1]) * of.along(on)[j] for on, value in pads] for j in size]
            alone = [-(value * of.along(on)[-1]) * on.by[""] for on, value in leg if nonzero(on.by.get("", 0))]
            force = {"q": [*map(self.sum, lifts)], "v": [*map(self.sum, slows)], "constant": self.sum(alone)}
            found["contact"] = {"force": force, "compression": force | {"v": [0 for _ in size]}, "tolerance": "0"}
        if of.law:
            p, d = of.law
            (drive,) = (row.by[of.input] for _, row in of.forces if of.input in row.by)
            found["law"] = {
                "q": [self.sum([-p / drive])], "v": [self.sum([-d / drive])], "target": self.sum([p / drive]),
                "limit": Formula("", self.numbers).of(of.limit),
            }  # fmt: skip
        return found

    def state(self, stretch: str) -> dict[str, Any]:
        """Position and velocity by the start, and which of these are equal to a stop that is an input."""
        *first, last = self.moving
        stops = [self.limit(each) for pair in self.of.stops.values() for each in pair]
        tied = [["x1", *(name for name in stops if re.fullmatch(r"\w+", name))]] if "x1" in self.axes else []
        if "y" not in self.axes:
            return {
                "position": ["x1"],
                "velocity": ["v1"],
                "tied": tied,
                "outputs": {"x1": {"q": [1]}, "v1": {"v": [1]}},
            }

        def stretched(place: str) -> str:
            """y where the last coordinate is 0 and the other one is this."""
            text = re.sub(rf"\b{last}\b", "0", stretch)
            for name in first:
                text = re.sub(rf"\b{name}\b", place, text)
            return f"({text})"

        none, unit = [0 for _ in first], [1 for _ in first]
        by_first = [f"{stretched('1')} - {stretched('0')}" for _ in first]
        outputs: dict[str, Any] = {"y": {"q": [*by_first, -1], "constant": stretched("0")}, "v2": {"v": [*none, 1]}}
        outputs |= {"x1": {"q": [*unit, 0]}, "v1": {"v": [*unit, 0]}} if first else {}
        place, rate = [*["x1" for _ in first], f"{stretched('x1')} - y"], [*["v1" for _ in first], "v2"]
        return {"position": place, "velocity": rate, "tied": tied, "outputs": outputs}

    def problem(
        self, robot: Mapping[str, float], start: Mapping[str, float], steps: Sequence[tuple[float, float]],
        horizon: float, units: Mapping[str, float], most: int,
    ) -> dict[str, Any]:  # fmt: skip
        """units: of the time and of the outputs, which are those of the start; most: phases."""
        return {
            **self.text,
            "parameters": {**robot, **self.numbers},
            "start": {name: start[name] for name in self.axes},
            "u": [list(step) for step in steps],
            "horizon": horizon,
            "max_phases": most,
            "units": dict(units),
        }


def nonzero(*values: Any) -> bool:
    return all(isinstance(value, Formula) or value for value in values)
