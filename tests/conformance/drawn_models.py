"""Model files of random elements, as texts, and what each means as physics, element by element, for the integrator.

A file declares one or two coordinates and what acts on them, with parameters in expressions; the same elements are
evaluated here with the parameters' numbers by Newton's law, without the derivation.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tests.conformance.zoo import Case, Draw, rate
from tests.oracle.numeric import Mass, Mechanism

Array = NDArray[np.float64]


@dataclass
class Line:
    """A stretch, a velocity or a force: its text, and by how much it goes with each coordinate; the offset."""

    text: str
    by: tuple[float, ...]
    offset: float = 0.0


@dataclass
class Drawn:
    """A file as it grows, with the parameters' numbers and the terms of Newton's law."""

    draw: Draw
    angular: bool
    masses: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    held: list[bool] = field(default_factory=list)
    parameters: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    robot: dict[str, float] = field(default_factory=dict)
    springs: list[tuple[float, Line]] = field(default_factory=list)
    dampers: list[tuple[float, Line]] = field(default_factory=list)
    constants: list[tuple[int, float, float]] = field(default_factory=list)
    """Mass, force, and force per current."""
    sliding: dict[int, tuple[float, float]] = field(default_factory=dict)
    at_rest: dict[int, tuple[float, float]] = field(default_factory=dict)
    ends: dict[int, tuple[float, float]] = field(default_factory=dict)
    law: tuple[float, float, float] | None = None
    """What sets the current: force per angle and per velocity, and the largest current."""
    stands: bool = False
    """Whether the springs between the two masses are a leg on the ground."""
    limit: str = ""

    # ---- numbers, some of them written as expressions of parameters ----

    def value(self, number: float, unit: str, domain: str = "real") -> str:
        """A spelling of a number: a parameter, a multiple, a product or a quotient of two, or the number itself."""
        form = self.draw.randrange(5)
        if form == 0 or number == 0.0:
            return repr(float(number))
        if form == 1:
            return f"2*{self.parameter(0.5 * number, unit, domain)}"
        if form == 2:
            factor = self.draw.uniform(0.5, 2.0)
            share = self.parameter(factor, "1", "positive")
            return f"{self.parameter(number / factor, unit, domain)}*{share}"
        if form == 3:
            factor = self.draw.uniform(0.5, 2.0)
            part = self.parameter(number * factor, unit, domain)
            return f"{part}/{self.parameter(factor, '1', 'positive')}"
        return self.parameter(number, unit, domain)

    def parameter(self, number: float, unit: str, domain: str) -> str:
        name = f"p{len(self.parameters)}"
        self.parameters.append(f'{name} = parameter("{name}", "{unit}", "a number of {name}", "{domain}")')
        self.robot[name] = number
        return name

    # ---- units ----

    @property
    def metre(self) -> str:
        return "rad" if self.angular else "m"

    @property
    def newton(self) -> str:
        return "N m" if self.angular else "N"

    # ---- elements ----

    def coordinate(self, name: str, inertia: float, held: bool) -> None:
        unit = "kg m^2" if self.angular else "kg"
        written = self.value(inertia, unit, "positive")
        self.names.append(name)
        self.masses.append(inertia)
        self.held.append(held)
        self.lines.append(f'{name} = coordinate("{name}", "{self.metre}", {written}{", held=True" if held else ""})')

    def where(self, by: tuple[float, ...], anywhere: bool = False) -> str:
        """Where an element acts: what acts on the body of a leg acts in stance, but for a constant force."""
        on_body = self.stands and by == (0.0, 1.0)
        return ', where="stance"' if on_body and not (anywhere and self.draw.random() < 0.5) else ""

    def stretch(self, line: Line) -> str:
        """The stretch or its opposite: the sign does not matter."""
        return f"-({line.text})" if self.draw.random() < 0.3 else line.text

    def spring(self, line: Line, stiffness: float, damping: float = 0.0, *, leg: bool = False) -> None:
        damper = ""
        if damping:
            written = self.value(damping, f"{self.newton} s/{self.metre}", "nonnegative")
            damper = f".damper({written}, 'damper {self.count}')"
            self.dampers.append((damping, line))
        written = self.value(stiffness, f"{self.newton}/{self.metre}", "positive")
        self.springs.append((stiffness, line))
        text = f"spring({self.stretch(line)}, {written}, 'spring {self.count}'){damper}"
        self.lines.append(f"contact({text}, {self.draw.choice(['0', '0.05'])})" if leg else text)

    def viscous(self, line: Line, damping: float) -> None:
        self.dampers.append((damping, line))
        written = self.value(damping, f"{self.newton} s/{self.metre}", "nonnegative")
        self.lines.append(f"viscous({line.text}, {written}, 'viscous {self.count}'{self.where(line.by)})")

    def push(self, mass: int, force: float, per_current: float = 0.0) -> None:
        self.constants.append((mass, force, per_current))
        kind = "torque" if self.angular else "force"
        parts = []
        if force:
            parts.append(self.value(force, self.newton))
        if per_current:
            size = self.value(abs(per_current), f"{self.newton}/A", "positive")  # which a law divides by
            parts.append(f"{'-' if per_current < 0.0 else ''}{size}*i")
        where = "" if per_current else self.where(tuple(float(n == mass) for n in range(len(self.masses))), True)
        self.lines.append(f"{kind}({self.names[mass]}, {' + '.join(parts) or '0'}, '{kind} {self.count}'{where})")

    def gravity(self, mass: int, acceleration: float) -> None:
        self.constants.append((mass, -self.masses[mass] * acceleration, 0.0))
        self.lines.append(f"gravity({self.names[mass]}, {self.value(acceleration, 'm/s^2', 'nonnegative')})")

    def friction(self, mass: int, forward: float, backward: float, factor: float) -> None:
        name, levels = self.names[mass], (forward, backward)
        self.sliding[mass], self.at_rest[mass] = levels, levels
        write = lambda level: self.value(level, self.newton, "nonnegative")  # noqa: E731
        if self.draw.random() < 0.5:
            text = f"friction({name}, {write(forward)}"
            self.sliding[mass] = self.at_rest[mass] = levels = (forward, forward)
        else:
            text = f"friction({name}, forward={write(forward)}, backward={write(backward)}"
        if factor > 1.0:
            rest = (factor * levels[0], factor * levels[1])
            if levels[0] == levels[1] and self.draw.random() < 0.5:
                text += f", at_rest={write(rest[0])}"
            else:
                text += f", at_rest=({write(rest[0])}, {write(rest[1])})"
            self.at_rest[mass] = rest
        where = self.where(tuple(float(n == mass) for n in range(len(self.masses))))
        self.lines.append(f"{text}{where})")

    def stop(self, mass: int, low: float, high: float) -> None:
        ends = []
        for end, infinite, domain in ((low, -math.inf, "lower"), (high, math.inf, "upper")):
            if math.isinf(end):
                ends.append(self.draw.choice(["None", self.parameter(infinite, self.metre, domain)]))
            else:
                ends.append(self.draw.choice([repr(end), self.parameter(end, self.metre, domain)]))
        self.ends[mass] = (low, high)
        if ends != ["None", "None"]:
            self.lines.append(f"stop({self.names[mass]}, {ends[0]}, {ends[1]})")

    def set_by_law(self, proportional: float, derivative: float, limit: float) -> None:
        self.law = proportional, derivative, limit
        by_angle = self.value(proportional, f"{self.newton}/{self.metre}", "nonnegative")
        by_velocity = self.value(derivative, f"{self.newton} s/{self.metre}", "nonnegative")
        text = f"law(i, {self.names[0]}, proportional={by_angle}"
        self.lines.append(text + (f", derivative={by_velocity})" if derivative else ")"))
        self.limit = self.parameter(limit, "A", "bound")

    @property
    def count(self) -> int:
        return len(self.lines)

    # ---- the whole ----

    @property
    def text(self) -> str:
        """The file: elements in any order, behind the coordinates and the current."""
        head = [line for line in self.lines if " = coordinate(" in line]
        rest = [line for line in self.lines if " = coordinate(" not in line]
        self.draw.shuffle(rest)
        limit = f", limit={self.limit or 10}" if self.stands or self.law else ""
        current = [f'i = current("i", "A"{limit})'] if any("*i" in line for line in rest) else []
        whole = [*head, *current, *rest]
        used = [line for line in self.parameters if any(_has(other, line.split()[0]) for other in whole)]
        body = "\n".join([*used, *head, *current, *rest])
        self.robot = {line.split()[0]: self.robot[line.split()[0]] for line in used}
        return f'"""A mechanism of random elements."""\n\nfrom hopform.model import *\n\n{body}\n'

    def force(self, q: Array, v: Array, u: float) -> Array:
        """Newton's law without dry friction: springs and dampers act against what stretches them. Under a law u is its
        target.
        """
        total = np.zeros(len(self.masses))
        for stiffness, line in self.springs:
            by = np.array(line.by)
            total -= stiffness * (by @ q + line.offset) * by
        for damping, line in self.dampers:
            by = np.array(line.by)
            total -= damping * (by @ v) * by
        for mass, constant, per_current in self.constants:
            current = u if self.law is None else float(np.clip(self.asked(q, v, u), -self.law[2], self.law[2]))
            total[mass] += constant + per_current * current
        return total

    def asked(self, q: Array, v: Array, target: float) -> float:
        """The current that a law asks for, of whatever size."""
        assert self.law is not None
        proportional, derivative, _ = self.law
        return float((proportional * (target - q[0]) - derivative * v[0]) / self.per_current)

    @property
    def per_current(self) -> float:
        return next((each for _, _, each in self.constants if each), 0.0)

    @property
    def moving(self) -> list[int]:
        return [n for n, held in enumerate(self.held) if not held]

    def mechanism(self) -> Mechanism:
        """Newton's law of what moves; what is held stays at 0."""
        never, moving = (-math.inf, math.inf), self.moving

        def force(q: Array, v: Array, u: float) -> Array:
            whole = np.zeros((2, len(self.masses)))
            whole[:, moving] = q, v
            return self.force(*whole, u)[moving]

        def contact(q: Array, v: Array) -> float:
            """What the leg carries: its springs and dampers."""
            between = [(k, line) for k, line in self.springs if len(line.by) == 2 and all(line.by)]
            dampers = [(d, line) for d, line in self.dampers if len(line.by) == 2 and all(line.by)]
            along = np.array([1.0, -1.0])
            return float(
                sum(k * (np.array(line.by) @ q + line.offset) * line.by[0] for k, line in between)
                + sum(d * (along @ v) for d, _ in dampers)
            )

        bends = () if self.law is None or math.isinf(self.law[2]) else (-self.law[2], self.law[2])
        return Mechanism(
            tuple(
                Mass(
                    self.names[n], self.masses[n], self.sliding.get(n, (0.0, 0.0)), self.at_rest.get(n),
                    *self.ends.get(n, never),
                )
                for n in moving
            ),
            force,
            contact if self.stands else None,
            tuple(lambda q, v, u, end=end: self.asked(q, v, u) - end for end in bends),
        )  # fmt: skip


def _has(line: str, name: str) -> bool:
    """Whether a line has the name as a word."""
    words = "".join(letter if letter.isalnum() or letter == "_" else " " for letter in line).split()
    return name in words


def lines_of(made: Drawn, two: bool) -> tuple[Line, Line]:
    """What the spring stretches, with an offset and a factor in some, and the same without them."""
    draw, names = made.draw, made.names
    if two:
        a, b = names if draw.random() < 0.5 else names[::-1]
        by = tuple(1.0 if name == a else -1.0 for name in names)
        offset = 0.3 if made.stands else draw.choice([0.0, draw.uniform(-0.3, 0.3)])
        a, b = names if made.stands else (a, b)
        by = (1.0, -1.0) if made.stands else by
        along = Line(f"{a} - {b}" + (f" + {made.value(offset, made.metre)}" if offset else ""), by, offset)
        between = Line(f"{a} - {b}", by)
    else:
        gain = draw.choice([1.0, 1.0, 2.0])
        offset = draw.choice([0.0, draw.uniform(-0.3, 0.3)])
        own = names[0] if gain == 1.0 else f"2*{names[0]}"
        along = Line(own + (f" - {made.value(offset, made.metre)}" if offset else ""), (gain,), -offset)
        between = Line(names[0], (1.0,))
    return along, between


def drawn(seed: int) -> tuple[Drawn, float]:
    """A file of one or two masses, and the size of its forces."""
    draw = Draw(f"elements {seed}")
    made = Drawn(draw, angular=draw.random() < 0.5)
    two = draw.random() < 0.5
    names = draw.choice([["q", "theta"], ["x1", "x2"], ["s", "z"], ["alpha", "beta"]])
    bolted = draw.randrange(2) if two and draw.random() < 0.3 else -1
    for n, name in enumerate(names[: 1 + two]):
        made.coordinate(name, draw.over(0.1, 10.0), n == bolted)
    light = min(made.masses)
    k = light * draw.over(3.0, 30.0) ** 2
    size = 0.2 * k
    made.stands = two and bolted < 0 and not made.angular and draw.random() < 0.4
    n = draw.choice([0, 1]) if two and not made.stands else 0  # the driven one, which has the stops
    n = 1 - bolted if bolted >= 0 else n
    along, between = lines_of(made, two)
    if two or draw.random() < 0.8:
        damping = draw.choice([0.0, draw.over(1e-3, 0.3) * math.sqrt(k * light)])
        made.spring(along, k, damping, leg=made.stands)
        if draw.random() < 0.4:
            made.spring(between, k * draw.over(0.01, 1.0))
    if draw.random() < 0.3:
        made.viscous(between, draw.over(1e-3, 0.3) * math.sqrt(k * light))
    for mass in range(1 + two):
        ground = Line(names[mass], tuple(1.0 if each == mass else 0.0 for each in range(1 + two)))
        for _ in range(draw.choice([0, 1, 1, 2])):
            made.viscous(ground, draw.over(1e-3, 0.5) * math.sqrt(k * light))
        if draw.random() < 0.75:
            forward, backward = draw.over(1e-3, 0.5) * size, draw.over(1e-3, 0.5) * size
            made.friction(mass, forward, backward, draw.choice([1.0, draw.uniform(1.0, 2.0)]))
        if draw.random() < 0.5:
            made.push(mass, draw.uniform(-0.3, 0.3) * size)
    if made.stands:
        made.gravity(1, draw.choice([9.81, 1.62]))
    elif not made.angular and draw.random() < 0.4:
        made.gravity(draw.randrange(1 + two), draw.choice([9.81, 1.62]))
    if draw.random() < 0.8:
        made.push(n, draw.choice([0.0, draw.uniform(-0.2, 0.2) * size]), draw.either(0.1, 1.0) * size)
    if draw.random() < 0.6:
        made.stop(n, -draw.over(0.05, 1.0), draw.choice([draw.over(0.05, 1.0), math.inf]))
    add_law(made, k)
    return made, k


def add_law(made: Drawn, k: float) -> None:
    """To half of the files of one mass that have a current."""
    draw = made.draw
    if len(made.masses) == 1 and made.per_current and draw.random() < 0.5:
        proportional = k * draw.over(0.1, 10.0)
        derivative = draw.choice([0.0, draw.over(0.02, 2.0) * math.sqrt(proportional * made.masses[0])])
        limit = abs(proportional / made.per_current) * draw.over(1e-2, 1.0)
        made.set_by_law(proportional, derivative, draw.choice([limit, limit, math.inf]))


def case(made: Drawn, k: float, seed: int) -> Case:
    """A start and a current, with the mechanism; the parameters' numbers are those of the drawing."""
    draw = Draw(f"start {seed}")
    names = [made.names[n] for n in made.moving]
    q, v = np.zeros(len(names)), np.zeros(len(names))
    for place, n in enumerate(made.moving):
        low, high = made.ends.get(n, (-math.inf, math.inf))
        q[place] = draw.uniform(max(low, -0.5), min(high, 0.5)) if draw.random() < 0.9 else max(low, -0.5)
        v[place] = draw.either(0.01, 3.0) if draw.random() < 0.8 else 0.0
    contact = made.mechanism().contact
    if contact is not None:  # pressed, whatever a damper in the leg says
        v[1], q[1] = -draw.over(0.1, 2.0), q[0]
        softens = contact(q, 0.0 * v) - contact(q + np.array([0.0, 1.0]), 0.0 * v)
        q[1] += min(contact(q, v), contact(q, 0.0 * v)) / softens - draw.over(1e-3, 0.1)
    velocities = [f"v{name[1:]}" if name.startswith("x") else f"{name}_dot" for name in names]
    start = dict(zip([*names, *velocities], [*map(float, q), *map(float, v)], strict=True))
    has_current = any(per_current for _, _, per_current in made.constants)
    u = draw.uniform(-1.0, 1.0) if has_current else 0.0
    light = min(made.masses)
    by_law = made.law or (0.0, 0.0)
    sums = (sum(each for each, _ in terms) for terms in (made.springs, made.dampers))
    stiffness, damping = (4.0 * (each + more) for each, more in zip(sums, by_law, strict=False))
    fastest = rate(*((mass, stiffness, damping) for mass in made.masses)) + 1.0
    horizon = 10.0 / math.sqrt(k / light)
    fastest = max(fastest, 50.0 / horizon)  # a stop is met and left within one long step else
    return Case(made.robot, start, u, horizon, made.mechanism(), tuple(q), tuple(v), fastest)
