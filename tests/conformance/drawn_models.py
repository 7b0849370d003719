"""Model files of random elements, as texts: one or two coordinates and what acts on them, with parameters in expressions.

What such a file means as physics tests/oracle/elements.py reads from it, as from every other.
"""

import re
from dataclasses import dataclass, field

from tests.conformance.zoo import Draw, number


@dataclass
class Drawn:
    """A file as it grows."""

    draw: Draw
    angular: bool
    names: list[str] = field(default_factory=list)
    parameters: list[str] = field(default_factory=list)
    head: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    stands: bool = False
    """Whether the springs between the two masses are a leg on the ground."""

    @property
    def metre(self) -> str:
        return "rad" if self.angular else "m"

    @property
    def newton(self) -> str:
        return "N m" if self.angular else "N"

    @property
    def damping(self) -> str:
        return self.value(f"{self.newton} s/{self.metre}", "nonnegative")

    @property
    def stiffness(self) -> str:
        return self.value(f"{self.newton}/{self.metre}", "positive")

    def value(self, unit: str, domain: str = "real") -> str:
        """A spelling of a number: a parameter, a multiple, a product or a quotient of two, or the number itself."""
        form = self.draw.randrange(5)
        if form == 0:
            return repr(number(self.draw, domain, 1.0))
        own = self.parameter(unit, domain)
        share = self.parameter("1", "positive") if form in (2, 3) else ""
        return {1: f"2*{own}", 2: f"{own}*{share}", 3: f"{own}/{share}", 4: own}[form]

    def parameter(self, unit: str, domain: str) -> str:
        name = f"p{len(self.parameters)}"
        self.parameters.append(f'{name} = parameter("{name}", "{unit}", "a number of {name}", "{domain}")')
        return name

    def add(self, text: str, on_body: bool = False) -> None:
        """What acts on the body of a leg acts in stance."""
        where = ', where="stance"' if on_body and self.stands else ""
        self.lines.append(text.replace("#", f"'element {len(self.lines)}'") + where + ")")

    def friction(self, n: int) -> None:
        level = lambda: self.value(self.newton, "nonnegative")  # noqa: E731
        forward, backward, more = level(), level(), level()
        rest, same = self.draw.choice([f"({forward} + {more}, {backward} + 2*{more})", ""]), self.draw.random() < 0.5
        if same:
            rest = rest and f"{forward} + {more}"
        text = forward if same else f"forward={forward}, backward={backward}"
        self.add(f"friction({self.names[n]}, {text}{rest and f', at_rest={rest}'}", on_body=n == 1)

    def push(self, n: int, parts: list[str]) -> None:
        kind, names = ("torque" if self.angular else "force"), self.names
        on_body = n == 1 and self.draw.random() < 0.5
        self.add(f"{kind}({names[n]}, {' + '.join(parts)}, #", on_body)

    def stop(self, n: int) -> None:
        ends = []
        for domain in ("lower", "upper"):
            literal = number(self.draw, domain, 1.0)
            ends.append(self.draw.choice(["None", repr(literal), self.parameter(self.metre, domain)]))
        ends = ["None" if "inf" in end else end for end in ends]
        if ends != ["None", "None"]:
            self.add(f"stop({self.names[n]}, {', '.join(ends)}")

    @property
    def text(self) -> str:
        """The file: elements in any order, behind the coordinates and the current."""
        self.draw.shuffle(self.lines)
        body = [*self.head, *self.lines]
        words = set(re.findall(r"\w+", "\n".join(body)))
        used = [line for line in self.parameters if line.split()[0] in words]
        whole = "\n".join([*used, *body])
        return f'"""A mechanism of random elements."""\n\nfrom hopform.model import *\n\n{whole}\n'


def drawn(seed: int) -> str:
    """A file of one or two masses."""
    draw = Draw(f"elements {seed}")
    made = Drawn(draw, angular=draw.random() < 0.5)
    two = draw.random() < 0.5
    bolted = draw.randrange(2) if two and draw.random() < 0.3 else -1
    made.names = draw.choice([["q", "theta"], ["x1", "x2"], ["s", "z"], ["alpha", "beta"]])[: 1 + two]
    unit = "kg m^2" if made.angular else "kg"
    for n, name in enumerate(made.names):
        held = ", held=True" if n == bolted else ""
        made.head.append(f'{name} = coordinate("{name}", "{made.metre}", {made.value(unit, "positive")}{held})')
    made.stands = two and bolted < 0 and not made.angular and draw.random() < 0.4
    driven = 1 - bolted if bolted >= 0 else draw.choice([0, 1]) if two and not made.stands else 0
    add_springs(made, two)
    for n, name in enumerate(made.names):
        for _ in range(draw.choice([0, 1, 1, 2])):
            made.add(f"viscous({name}, {made.damping}, #", on_body=n == 1)
        if draw.random() < 0.75:
            made.friction(n)
        if draw.random() < 0.5:
            made.push(n, [made.value(made.newton)])
    if not made.angular and (made.stands or draw.random() < 0.4):
        n = 1 if made.stands else draw.randrange(1 + two)
        made.add(f"gravity({made.names[n]}, {made.value('m/s^2', 'nonnegative')}")
    if draw.random() < 0.8:
        add_current(made, driven, two)
    if draw.random() < 0.6:
        made.stop(driven)
    return made.text


def add_springs(made: Drawn, two: bool) -> None:
    """What a spring stretches has an offset and a factor in some, and the sign does not matter."""
    draw, (name, *_) = made.draw, made.names
    if two:
        a, b = made.names if made.stands or draw.random() < 0.5 else made.names[::-1]
        plain, sign = f"{a} - {b}", "+"
    else:
        plain, sign = draw.choice([name, name, f"2*{name}"]), "-"
    offset = f" {sign} {made.value(made.metre)}" if made.stands or draw.random() < 0.5 else ""
    if two or draw.random() < 0.8:
        stretch = f"-({plain}{offset})" if draw.random() < 0.3 else f"{plain}{offset}"
        text = f"spring({stretch}, {made.stiffness}, 'first')"
        text += f".damper({made.damping}, 'damper')" if draw.random() < 0.5 else ""
        made.lines.append(f"contact({text}, {draw.choice(['0', '0.05'])})" if made.stands else text)
        if draw.random() < 0.4:
            made.add(f"spring({plain}, {made.stiffness}, #")
    if draw.random() < 0.3:
        made.add(f"viscous({plain}, {made.damping}, #")


def add_current(made: Drawn, driven: int, two: bool) -> None:
    """With a law in half of the files of one mass."""
    draw, law = made.draw, not two and made.draw.random() < 0.5
    limit = made.parameter("A", "bound") if law else "10"
    made.head.append(f'i = current("i", "A"{f", limit={limit}" if law or made.stands else ""})')
    force = f"{draw.choice(['', '-'])}{made.value(f'{made.newton}/A', 'positive')}*i"
    made.push(driven, [*draw.choice([[], [made.value(made.newton)]]), force])
    if law:
        derivative = f", derivative={made.damping}" if draw.random() < 0.5 else ""
        proportional = made.value(f"{made.newton}/{made.metre}", "nonnegative")
        made.add(f"law(i, {made.names[0]}, proportional={proportional}{derivative}")
