"""What each formula is to be as a number, of a robot in a mode, from the elements' equations of motion alone.

States are exp(M t) z(0), with M by differences of accelerations; transforms solve (s - M) Z = z(0) + d/s; numerators are
fitted to values of them; poles are the roots of the characteristic polynomial of M.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import mpmath
import sympy as sp
from sympy.printing.pycode import MpmathPrinter

from ..maths.elements import POLYNOMIALS
from ..maths.formulas import key_of
from .linear import along, beside, chain, products, resolvent, response, roots
from .mechanics import Mechanics

WORKING = 120
"""Digits of the arithmetic: what is lost where poles or coefficients nearly vanish, twice 40, and 40 to compare."""

Known = Mapping[str, Any]
"""Values by the names that formulas take."""


class _OfNames(MpmathPrinter):
    """Symbols as members of a mapping, whatever they assume: lambdify needs three times as long for the same."""

    def _print_Symbol(self, expr: sp.Symbol) -> str:  # noqa: N802 - the name that sympy calls
        return f"at[{expr.name!r}]"


@cache
def _compiled(expression: sp.Expr) -> Callable[[Known], Any]:
    """An expression as a function of the values of its symbols."""
    text = _OfNames({"fully_qualified_modules": False, "inline": True}).doprint(expression)
    return eval(f"lambda at: {text}", vars(mpmath))  # noqa: S307 - of sympy's own text


def number(value: Any, known: Known, **others: Any) -> Any:
    """An expression as a number of WORKING digits, by the values of its symbols."""
    return mpmath.mpmathify(_compiled(sp.sympify(value))({**known, **others} if others else known))


class Own:
    """What formulas are to be, by their names in the derivation, of a robot in a mode; None where a pole makes it none.

    No formula is read. moving: the masses that slip. The motion of z = (x_1, v_1, x_2, v_2, 1) is exp(M t) z(0), with M by
    differences of the elements' accelerations, which are affine.
    """

    def __init__(self, mechanics: Mechanics, moving: tuple[int, ...], known: Known, *, follows: bool = False) -> None:
        """follows: whether a law sets the current, and not its limit."""
        self.m, self.moving, self.known = mechanics, moving, known
        self.follows = follows
        self.accelerations = mechanics.under_law if follows else mechanics.acceleration
        self.names = {key: symbol.name for key, symbol in mechanics.inputs.items()}

    def of(self, key: str) -> Any:
        return self.known[self.names[key]]

    @property
    def t(self) -> Any:
        return self.of("t")

    @property
    def rate(self) -> Any:
        """The fastest rate of the mode, or 1 where nothing changes."""
        s_1, s_2, *_ = self.rates
        return abs(s_1) + mpmath.sqrt(abs(s_2)) or mpmath.mpf(1)

    def number(self, value: Any, **others: Any) -> Any:
        return number(value, self.known, **others)

    def acceleration(self, n: int, state: Sequence[Any] = (0, 0, 0, 0), **others: Any) -> Any:
        """Of a mass at x_1, v_1, x_2, v_2."""
        at = {self.names[key]: mpmath.mpf(value) for key, value in zip(("x1", "v1", "x2", "v2"), state, strict=True)}
        return self.number(self.accelerations[n], **(at | {self.names[key]: value for key, value in others.items()}))

    @cached_property
    def slopes(self) -> dict[tuple[int, int], Any]:
        """Of the acceleration of each mass, by the places of x_1, v_1, x_2, v_2."""
        unit = [[int(i == j) for j in range(4)] for i in range(4)]
        return {(n, j): self.acceleration(n, unit[j]) - self.constant[n] for n in self.m.masses for j in range(4)}

    @cached_property
    def constant(self) -> dict[int, Any]:
        """The acceleration of each mass where z is 0."""
        return {n: self.acceleration(n) for n in self.m.masses}

    @cached_property
    def matrix(self) -> list[list[Any]]:
        """M of the mode."""
        matrix = [[mpmath.mpf(0)] * 5 for _ in range(5)]
        for n in self.moving:
            matrix[2 * n - 2][2 * n - 1] = mpmath.mpf(1)
            matrix[2 * n - 1] = [*(self.slopes[n, j] for j in range(4)), self.constant[n]]
        return matrix

    @cached_property
    def start(self) -> list[Any]:
        """z(0)."""
        start = [
            self.of(key) if int(key[1]) in self.m.masses else mpmath.mpf(0) for key in ("x1_0", "v1_0", "x2_0", "v2_0")
        ]
        for n in {1, 2} - {*self.moving}:
            start[2 * n - 1] = mpmath.mpf(0)
        return [*start, mpmath.mpf(1)]

    @cached_property
    def end(self) -> list[Any]:
        """z(t)."""
        return along(self.matrix, self.start, self.t)

    @cached_property
    def rates(self) -> list[Any]:
        """The coefficients of P(s) of the mode, behind the highest."""
        return self.polynomial(self.moving)

    def polynomial(self, masses: tuple[int, ...]) -> list[Any]:
        """The characteristic polynomial of masses that slip, without the integrator that both share, behind s^n."""
        places = [place for n in masses for place in (2 * n - 2, 2 * n - 1)]
        block = [
            [
                self.slopes[place // 2 + 1, other] if place % 2 else mpmath.mpf(int(other == place + 1))
                for other in places
            ]
            for place in places
        ]
        return resolvent(block)[0][1 : (4 if len(masses) == 2 else 3)]

    @cached_property
    def roots(self) -> list[Any]:
        """The poles; with both masses the real one first, at 0 or the farthest from the mean of all."""
        found = roots(self.rates)
        if len(self.moving) == 1:
            return found
        mean = sum(found) / 3
        real = [r for r in found if abs(mpmath.im(r)) <= mpmath.mpf(10) ** -50 * (1 + abs(r))]
        first = next((r for r in real if r == 0), None)
        first = max(real, key=lambda r: abs(r - mean)) if first is None else first
        rest = list(found)
        rest.remove(first)
        return [mpmath.re(first), *rest]

    # ---- the linear system ----

    def linear_system(self) -> dict[str, list[Any]]:
        """Of the masses that slip, row by row: M, the drive at the positions of what is held, the input matrix, by the
        input if there is one and by a force on each, and exp(M t) beside its integral times that.
        """
        places = [place for n in self.moving for place in (2 * n - 2, 2 * n - 1)]
        held = [2 * n - 2 for n in self.m.masses if n not in self.moving]
        at = {place: self.of(key) for place, key in ((0, "x1"), (2, "x2")) if place in held}
        drives = [
            self.matrix[place][4] + sum(self.matrix[place][j] * value for j, value in at.items()) for place in places
        ]
        block, columns = [[self.matrix[i][j] for j in places] for i in places], list[list[Any]]()
        if self.m.model.driven_by is not None:
            columns.append([self._per_input(place) for place in places])
        for n in self.moving:
            columns.append([mpmath.mpf(place == 2 * n - 1) / self.number(self.m.inertia[n]) for place in places])
        inputs = [list(row) for row in zip(*columns, strict=True)]
        whole = [[*row, *more] for row, more in zip(block, inputs, strict=True)]
        whole += [[mpmath.mpf(0)] * len(whole[0]) for _ in columns]
        ends = [along(whole, [int(i == j) for i in range(len(whole))], self.t) for j in range(len(whole))]
        found = {
            "M": block,
            "drive": [drives],
            "B": inputs,
            "propagator": [list(row) for row in zip(*ends, strict=True)],
        }
        found["propagator"] = found["propagator"][: len(places)]
        return {name: [each for row in rows for each in row] for name, rows in found.items()}

    def _per_input(self, place: int) -> Any:
        """What the input adds to the rate of a member of z, per unit."""
        one, none = (self.acceleration(place // 2 + 1, u=mpmath.mpf(u)) for u in (1, 0))
        return one - none if place % 2 else mpmath.mpf(0)

    # ---- transforms ----

    @cached_property
    def numerators(self) -> list[list[Any]]:
        """Of the transforms of z over s^m P(s), m masses slipping, the highest coefficients first."""
        return self.pushed(self.start)

    def pushed(self, z: Sequence[Any]) -> list[list[Any]]:
        """The numerators of (s - M)^-1 z; the lowest powers of s, which what is held has beside these, are left out."""
        return list(map(list, zip(*(list(each * mpmath.matrix(z)) for each in self._adjugate), strict=True)))

    @cached_property
    def _adjugate(self) -> list[Any]:
        return resolvent(self.matrix)[1][: 2 * len(self.moving) + 1]

    def transform(self, numerator: Sequence[Any], s: Any) -> Any:
        """The value of a transform."""
        below = [1, *self.rates, *[0] * len(self.moving)]
        return mpmath.polyval(numerator, s) / mpmath.polyval(below, s)

    # ---- by groups of formulas ----

    def values(self) -> dict[str, Any]:
        with mpmath.workdps(WORKING):
            groups = (
                self._mechanics,
                self._coefficients,
                self._transfer,
                lambda: self.poles,
                self._fractions,
                self._states,
                self._rest,
                self._works,
                self._contact,
                self._events,
            )
            return {key: value for group in groups for key, value in group().items()}

    def _mechanics(self) -> dict[str, Any]:
        m = self.m
        kinetic = sum(m.kinetic.values())
        found = {
            "kinetic": kinetic,
            "potential": m.potential,
            "L": kinetic - m.potential,
            "total": kinetic + m.potential,
            **{key_of(entry, "power"): power for entry, power in m.powers.items()},
        }
        for n in m.masses:
            found[f"force_{n}"] = m.force(n, m.acting) + m.potential.diff(m.x[n])
            found[f"acc_{n}"] = m.acceleration[n]
        if m.model.has_contact and 2 in m.masses:
            found["body"] = m.body
            found["aed_power"] = m.rate(m.body) + sum(m.body.diff(m.v[n]) * m.acceleration[n] for n in m.masses)
        return {key: self.number(value) for key, value in found.items()}

    def _coefficients(self) -> dict[str, Any]:
        """Slopes by y = ratio x_1 - x_2 + length, v_1, v_2 and u, and the rest. y counts from the contact force 0 at rest, and
        without a contact from the main spring's own length.
        """
        m, found = self.m, dict[str, Any]()
        side = {f"side_{n}": mpmath.mpf(0) for n in m.masses}
        unloaded = [0, 0, self.length, 0] if 2 in m.masses else [-self.length, 0, 0, 0]
        for n in m.masses:
            by = {"y": (n, 2) if 2 in m.masses else (n, 0), "v1": (n, 1), "v2": (n, 3)}
            found |= {f"a{n}_{name}": self.slopes[place] for name, place in by.items()}
            if 2 in m.masses:
                found[f"a{n}_y"] = -found[f"a{n}_y"]
            at_rest = self.acceleration(n, unloaded, u=mpmath.mpf(0), **side)
            found[f"a{n}_u"] = self.acceleration(n, unloaded, u=mpmath.mpf(1), **side) - at_rest
            found |= {f"a{n}_0": at_rest, f"C_{n}": self.acceleration(n, unloaded)}
        if m.model.law is not None:
            found["asked"] = self.asked
        return found

    @cached_property
    def length(self) -> Any:
        if self.m.model.has_contact:
            return self.number(self.m.length)
        if self.m.main is None:
            return mpmath.mpf(0)
        stretch = self.m.own(self.m.main.on)
        slope = -stretch.diff(self.m.x[2]) if 2 in self.m.masses else stretch.diff(self.m.x[1])
        return self.number(stretch.subs({x: 0 for x in self.m.x.values()}) / slope)

    @cached_property
    def asked(self) -> Any:
        """The current that the law asks for; None where no current pulls."""
        return self.number(self.m.asked) if self.number(self.m.force(1, self.m.acting).diff(self.m.u)) else None

    def _transfer(self) -> dict[str, Any]:
        m, found, s = self.m, dict[str, Any](), self.of("s")
        slopes = {key: self.slopes.get(key, mpmath.mpf(0)) for key in ((n, j) for n in (1, 2) for j in range(4))}
        if 1 in m.masses:
            found["lambda_2"] = self.acceleration(1)
        if 2 in m.masses:
            found["gamma"] = -self.acceleration(2)
        for n in self.moving:
            found[f"X{n}"] = self.transform(self.numerators[2 * n - 2], s)
        if 1 in self.moving:
            response = self.pushed([0, self.number(self.accelerations[1].diff(m.u)), 0, 0, 0])
            found |= {f"X{n}_by_u": self.transform(response[2 * n - 2], s) for n in self.moving}
        x_1, v_1, x_2, v_2, _ = self.start
        if len(self.moving) == 2:
            found["beta_1"] = v_1 - slopes[1, 1] * x_1 - slopes[1, 3] * x_2
            found["beta"] = v_2 - slopes[2, 3] * x_2 - slopes[2, 1] * x_1
            found |= {"X1_by_X2": found["X1"], "X2_by_X1": found["X2"]}
            found["Z"] = (slopes[1, 2] + s * slopes[1, 3]) * found["X2"] / (s**2 - s * slopes[1, 1] - slopes[1, 0])
        for n in self.moving:
            _, *terms = self.numerators[2 * n - 2]
            found |= {f"H{4 - i}{'_hat' if n == 1 else ''}": term for i, term in enumerate(terms)}
        return found

    @cached_property
    def poles(self) -> dict[str, Any]:
        found = {
            str(symbol): value
            for masses, symbols in POLYNOMIALS.items()
            if {*masses} <= {*self.m.masses}
            for symbol, value in zip(symbols, self.polynomial(masses), strict=True)
        }
        if len(self.moving) == 2:
            first, *pair = self.roots
            mean = sum(self.roots) / 3
            shifted = [root - mean for root in self.roots]
            real = [root for root in shifted if abs(mpmath.im(root)) <= mpmath.mpf(10) ** -50 * (1 + abs(root))]
            products = [shifted[i] * shifted[j] for i, j in ((0, 1), (0, 2), (1, 2))]
            found |= {"sigma": -mean, "Q_s": sum(products), "T_s": -mpmath.fprod(shifted), "a": -first}
            found["apart"] = max(map(abs, real))
        else:
            pair = self.roots
            found["a"] = found[f"p_{self.moving[0]}"]
        found |= {"p": -sum(pair), "q": mpmath.fprod(pair), "disc": ((pair[0] - pair[1]) / 2) ** 2}
        found["w"] = mpmath.sqrt(abs(found["disc"]))
        found["slow"] = min(map(abs, pair)) if mpmath.re(found["disc"]) > 0 else mpmath.mpf(0)
        if self.m.model.law is not None:
            law, inertia = self.m.the("law"), self.m.inertia[1]
            proportional, derivative = (
                self.number(self.m.own(law.values[key]) / inertia) for key in ("proportional", "derivative")
            )
            found |= {"p_law": derivative - self.slopes[1, 1], "q_law": proportional - self.slopes[1, 0]}
        return {key: mpmath.re(value) for key, value in found.items()}

    def _fractions(self) -> dict[str, Any]:
        """Residues of X_n(s), where poles are apart from each other and from 0."""
        found = dict[str, Any]()
        both, integrates = len(self.moving) == 2, self.m.integrates(self.moving)
        first, *pair = self.roots if both else (mpmath.mpf(0), *self.roots)
        if both:
            found["chi"] = mpmath.re((pair[0] - first) * (pair[1] - first))
        for n in self.moving:
            hat, top = "_hat" if n == 1 else "", self.numerators[2 * n - 2]
            letters = [f"{letter}{hat}" for letter in "ABCDE"]
            found[f"x{n}_split"] = self.end[2 * n - 2]  # the sum of them
            if not both and integrates:
                a = self.rates[0]
                found |= dict.fromkeys(letters)
                if a != 0:  # x(t) = A + B t + C exp(-a t)
                    found[letters[1]] = top[-1] / a
                    found[letters[2]] = mpmath.polyval(top, -a) / a**2
                    found[letters[0]] = self.start[2 * n - 2] - found[letters[2]]
                else:
                    found[f"x{n}_split"] = None
                continue
            if 0 in self.roots or pair[0] == pair[1] or (both and found["chi"] == 0):
                found |= dict.fromkeys((*letters, f"x{n}_split"))
                continue
            power = 2 if both else 1
            if both:
                low, rates = mpmath.polyval(top, 0), self.rates
                found[letters[1]] = low / rates[2]
                found[letters[0]] = top[-2] / rates[2] - low * rates[1] / rates[2] ** 2
                found[letters[2]] = mpmath.polyval(top, first) / (first**2 * found["chi"])
            else:
                found[letters[0]] = top[-1] / mpmath.fprod(pair)
            at_pair = [mpmath.polyval(top, r) / (r**power * ((r - first) if both else 1)) for r in pair]
            slope = (at_pair[0] - at_pair[1]) / (pair[0] - pair[1])
            found |= {letters[3]: mpmath.re(slope), letters[4]: mpmath.re(at_pair[0] - slope * pair[0])}
        return found

    def _states(self) -> dict[str, Any]:
        found, t = dict[str, Any](), self.t
        ratio = self.number(self.m.ratio)
        found["y_0"] = ratio * self.start[0] - self.start[2] + self.length
        rows = {f"_{n}": (self.start[2 * n - 1], self.numerators[2 * n - 1]) for n in self.moving}
        one, x_1, x_2 = (self.numerators[place] for place in (4, 0, 2))
        stretch = [ratio * a - b + self.length * c for a, b, c in zip(x_1, x_2, one, strict=True)]
        rows["_y"] = (found["y_0"], stretch)
        for name, (begin, numerator) in rows.items():  # less its start over s, over s P(s)
            of_start = [begin * c for c in self.rates]
            left = zip(numerator[1:], of_start, strict=False)
            found |= {f"H{3 - i}{name}": value - of_start for i, (value, of_start) in enumerate(left)}
        for n in self.moving:
            found |= {f"x{n}_t": self.end[2 * n - 2], f"v{n}_t": self.end[2 * n - 1]}
        poles = self.poles
        rates = self.rates
        found["e"], found["e1"], found["e2"] = response([poles["a"]], t, 3)
        if len(self.moving) == 2:
            _, found["Wd"], found["W"], found["W1"], found["W2"] = response(rates, t, 5)
        else:
            _, found["Wd"], found["W"], found["W1"] = response(rates, t, 4)
        found["Rd"], found["R"], found["R1"], found["R2"] = response([poles["p"], poles["q"]], t, 4)
        found["turned"] = poles["q"] * found["R1"]
        _, *of_slow = (
            response([poles["slow"]], t, 3) if poles["disc"] > 0 else [None] * 3
        )  # of a pair that rings not read
        found |= {"slow": poles["slow"] if poles["disc"] > 0 else None} | dict(
            zip(("slow1", "slow2"), of_slow, strict=True)
        )
        return found

    def _rest(self) -> dict[str, Any]:
        """When what slips alone comes to rest, if it does, and by how much more than the last part of its motion needs."""
        if len(self.moving) == 2:
            return {}
        (n,), (first, second), side = self.moving, self.roots, self.of(f"side_{self.moving[0]}")
        speed = abs(self.start[2 * n - 1])
        at_rest = [mpmath.mpf(0) if place % 2 else value for place, value in enumerate(self.start[:4])]
        pull = side * self.acceleration(n, at_rest)
        rate, rings = pull + self.slopes[n, 2 * n - 1] * speed, mpmath.im(first) != 0  # rate of the speed
        slower = mpmath.mpf(0) if rings or self.m.integrates(self.moving) else min(abs(first), abs(second))
        found = {f"x{n}_braking": slower * speed - pull, f"x{n}_time_to_rest": None}
        if rings or found[f"x{n}_braking"] > 0:  # speed = c_1 exp(first t) + c_2 exp(second t)
            if first == second:
                found[f"x{n}_time_to_rest"] = speed / (first * speed - rate)
            else:
                one = (rate - second * speed) / (first - second)
                turned = mpmath.log((one - speed) / one)
                turned += 2j * mpmath.pi if rings and mpmath.re(turned / (first - second)) < 0 else 0
                found[f"x{n}_time_to_rest"] = mpmath.re(turned / (first - second))
        return found

    def _works(self) -> dict[str, Any]:
        """The work of each force along z(t), and integrals of products of the responses of poles."""
        t, poles, rates, found = self.t, self.poles, self.rates, dict[str, Any]()
        both, real = len(self.moving) == 2, poles["disc"] > 0
        slow = poles["slow"]
        if both:
            slow = found["a_least"] = min(map(abs, self.roots)) if real else poles["a"]
            found["p_others"] = rates[0] - slow
            found["q_others"] = rates[1] - slow * found["p_others"]
            found["least"], found["least1"] = response([slow], t, 2)
            found["others1"] = response([found["p_others"]], t, 2)[1]
        found["pair1"] = response([poles["p"]], t, 2)[1]
        system = beside(chain([slow], 2), chain(rates, 4))
        (_, *of_slow), (_, *of_slow_1), _, *squares = products(system, [1, 0, 1, 0, 0, 0], t)
        found |= {
            key: row[n] for n, (key, row) in enumerate(zip(("int_WdWd", "int_WW", "int_W1W1"), squares, strict=True), 3)
        }
        if both:
            found |= {
                "least_squared": of_slow_1[0],
                "int_eW": of_slow[3],
                "int_eW1": of_slow[4],
                "int_e1W1": of_slow_1[4],
            }
        else:
            found |= {"slow_squared": of_slow_1[0] if real else None, "int_eR": of_slow[2] if real else mpmath.mpf(0)}
        return found | self._integrals()

    def _integrals(self) -> dict[str, Any]:
        """Of products of the motion, and of each power: a quadratic form in z."""
        x_1, v_1, x_2, v_2, one = range(5)
        of = products(self.matrix, self.start, self.t)
        found = {"int_v1": of[v_1][one], "int_v2": of[v_2][one]}
        found |= {"int_v1v1": of[v_1][v_1], "int_v1v2": of[v_1][v_2], "int_v2v2": of[v_2][v_2]}
        ratio = self.number(self.m.ratio)
        for n, v in ((1, v_1), (2, v_2)):
            found[f"int_yv{n}"] = ratio * of[x_1][v] - of[x_2][v] + self.length * of[v][one]
        found["int_xv2"] = of[x_1][v_2] - self.start[x_1] * of[v_2][one]
        for entry, form in self.m.forms.items():
            found[key_of(entry, "work")] = sum(self.number(value) * of[i][j] for (i, j), value in form.items())
        if self.m.model.has_contact and 2 in self.m.masses:
            keys = [self.names[key] for key in ("x1", "v1", "x2", "v2")]
            after, before = (
                self.number(self.m.body, **dict(zip(keys, z, strict=False))) for z in (self.end, self.start)
            )
            found["aed_work"] = after - before
        return found

    def _contact(self) -> dict[str, Any]:
        """Touchdown, apex and what the controller of the paper minimises."""
        m = self.m
        if not m.model.has_contact:
            return {}
        number, fall = self.number, self.number(m.fall)
        loss = m.own(m.the("contact").values["impact_loss"])
        found = {"contact_force": number(m.contact)}
        found["v_after"] = -mpmath.sqrt(2 * fall * self.of("height") * (1 - number(loss)))
        speed = max(self.of("v2"), mpmath.mpf(0))
        found["apex"] = self.of("x2") - self.length + speed**2 / (2 * fall) if fall else None
        if m.model.is_of_the_paper and m.model.input is not None:
            pull = abs(number(m.force(1, m.acting).diff(m.u)))
            friction = number(m.stick_margin(1, "forward") * m.inertia[1] + m.pull(1))
            found["u_threshold"] = friction / pull if pull else None
            weight, stiffness = number(-m.force(2, m.weights)), number(m.potential.diff(m.x[1], 2))
            found["E_td"], found["E_dist"] = number(m.kinetic[2]), -weight * self.of("step")
            squares = self.of("x1") ** 2 - self.of("x1_T") ** 2
            found["E_spring"] = weight * self.of("x1") + stiffness * squares / 2
            found["J"] = abs(
                self.of("aed") - weight * self.of("h_des") + found["E_td"] + found["E_dist"] + found["E_spring"]
            )
        return found

    def _events(self) -> dict[str, Any]:
        m, found = self.m, dict[str, Any]()
        for n in m.masses:
            found[f"x{n}_velocity"] = self.of(f"v{n}")
            found[f"x{n}_coulomb_level"] = self.number(m.level(n) / m.inertia[n])
            frictions = [e for e in m.acting if e.kind == "friction"]
            drift = m.force(n, frictions).subs(m.side[n], 0)
            found[f"x{n}_free_acceleration"] = self.number((m.pull(n) + drift) / m.inertia[n])
            for way in ("forward", "backward"):
                found[f"x{n}_stick_margin_{way}"] = self.number(m.stick_margin(n, way))
        for each in m.draft.elements:
            if each.kind == "stop" and (k := m.number_of(each)) is not None:
                for key, sign, end in (("lower", 1, each.values["low"]), ("upper", -1, each.values["high"])):
                    if end is not None:
                        found[f"x{k}_{key}_stop"] = sign * (self.of(f"x{k}") - self.number(m.own(end)))
        if m.model.law is not None and m.limit is not None:
            most, asked = self.number(m.limit), self.asked
            found["room_up"] = None if asked is None else most - asked
            found["room_down"] = None if asked is None else most + asked
        return found


@dataclass(frozen=True)
class Exact:
    """A number, and by how much all inputs together move it: the sum of abs(z dx/dz) over what it is computed from."""

    value: float
    condition: float


def exactly(own: Own) -> dict[str, Exact]:
    """The state at time t and the poles, by their names in the derivation; derivatives are differences at 120 digits."""
    with mpmath.workdps(WORKING):
        base, step = _results(own), mpmath.mpf(10) ** -40
        conditions = dict.fromkeys(base, mpmath.mpf(0))
        read = {symbol.name for n in own.moving for symbol in own.accelerations[n].free_symbols}
        read |= {own.names[key] for key in ("t", "x1_0", "v1_0", "x2_0", "v2_0")}
        for name in sorted(read & own.known.keys()):
            moved = Own(own.m, own.moving, {**own.known, name: own.known[name] * (1 + step)}, follows=own.follows)
            for key, value in _results(moved).items():
                conditions[key] += abs(value - base[key]) / step
        return {key: Exact(float(value), float(conditions[key])) for key, value in base.items()}


def _results(own: Own) -> dict[str, Any]:
    found = {f"{letter}{n}_t": own.end[2 * n - 2 + i] for n in own.moving for i, letter in enumerate("xv")}
    real, pair = (-own.roots[0], own.roots[1:]) if len(own.moving) == 2 else (mpmath.mpf(0), own.roots)
    return found | {"a": real, "p": -mpmath.re(sum(pair)), "q": mpmath.re(mpmath.fprod(pair))}
