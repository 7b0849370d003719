"""The formulas of a mode as identities, by sympy's algebra."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import sympy as sp

from ..maths.elements import POLYNOMIALS
from ..maths.formulas import Formula, key_of
from ..model.equations import ModelError
from .mechanics import Mechanics, by_name

KERNELS = ("e", "e1", "e2", "slow1", "slow2", "Rd", "R", "R1", "R2", "turned", "Wd", "W", "W1", "W2")
"""Formulas of time that the state over time is a sum of, or that these are made of."""

Residual = tuple[str, sp.Expr]
"""The name in the derivation of the formula that an identity is about, and what is to be 0."""


class Algebra:
    """The formulas of a mode as identities that hold for all parameters, starts and times: each yields what is to be 0.

    A motion is a sum of kernels with constant coefficients, so its transform is that sum of theirs, 1/(s + a) of
    exp(-a t), 1/(s^2 + p s + q) of R and 1/P of W; what each kernel is in numbers is shown case by case.
    """

    def __init__(self, mechanics: Mechanics, formulas: Iterable[Formula], moving: tuple[int, ...]) -> None:
        self.m, self.moving = mechanics, moving
        self.by_key = {each.key: replace(each, value=by_name(each.value)) for each in formulas}
        self.values = {self.symbol(key): each.value for key, each in self.by_key.items()}
        self.t, self.s = mechanics.inputs["t"], mechanics.inputs["s"]
        self.both, self.integrates = len(moving) == 2, mechanics.integrates(moving)
        self.inverse = sp.Dummy("1/P(s)")

    def symbol(self, key: str) -> sp.Expr:
        """The symbol of a formula; 0 of one that is 0 for every robot."""
        return sp.Symbol(self.by_key[key].name, real=True) if key in self.by_key else sp.S.Zero

    def value(self, key: str, *stop: str) -> sp.Expr:
        """A formula in terms of parameters, inputs and the formulas named `stop`; 0 of one that is 0 for every robot."""
        return self.unfolded(self.by_key[key].value, *stop) if key in self.by_key else sp.S.Zero

    def unfolded(self, value: sp.Expr, *stop: str) -> sp.Expr:
        kept = {self.symbol(each) for each in stop}
        while read := (value.free_symbols & self.values.keys()) - kept:
            value = value.xreplace({symbol: self.values[symbol] for symbol in read})
        return value

    def transform(self, value: sp.Expr, kernels: Mapping[str, sp.Expr], rate: sp.Expr = sp.S.Zero) -> sp.Expr:
        """The transform of a sum of kernels, of powers of t, and of these times exp(-rate t)."""
        of = {self.symbol(key): own for key, own in kernels.items() if key in self.by_key}
        decay = sp.Dummy("exp(-rate t)")
        value = value.xreplace({sp.exp(-rate * self.t): decay}) if rate != 0 else value
        slopes = {kernel: value.diff(kernel) for kernel in of}
        if any(slope.free_symbols & {*of, self.t, decay} for slope in slopes.values()):
            raise ModelError(f"{value} is no sum of kernels")
        found = sum(slope * of[kernel] for kernel, slope in slopes.items())
        rest = value.xreplace(dict.fromkeys(of, sp.S.Zero))
        if not rest.free_symbols & {self.t, decay}:
            return found + rest / self.s
        terms = sp.Poly(rest, self.t, decay).terms()
        return found + sum(c * sp.factorial(n) / (self.s + m * rate) ** (n + 1) for (n, m), c in terms)

    @cached_property
    def denominator(self) -> sp.Expr:
        """P(s), in parameters."""
        s, rates = self.s, [self.value(str(key)) for key in POLYNOMIALS[self.moving]]
        return s ** len(rates) + sum(rate * s**power for power, rate in enumerate(reversed(rates)))

    @cached_property
    def motion(self) -> dict[str, sp.Expr]:
        """The transforms of x_n(t) and v_n(t) of the masses that slip, by the formula's name."""
        s, power = self.s, 0 if self.both else 1
        names = ("Wd", "W", "W1", "W2")
        of_w = {key: self.inverse / s**n for n, key in enumerate(names, power - 1)}
        keys = [f"{letter}{n}_t" for n in self.moving for letter in "xv"]
        return {key: self.transform(self.value(key, *of_w), of_w) for key in keys}

    def crossed(self, value: sp.Expr, wanted: sp.Expr) -> sp.Expr:
        """What is 0 where two transforms are one: their difference without denominators, that of 1/P(s) among them."""
        top, bottom = sp.fraction(value)
        difference = top - bottom * wanted
        return difference.xreplace({self.inverse: sp.S.Zero}) * self.denominator + difference.diff(self.inverse)

    def forces(self) -> Iterator[Residual]:
        """Lagrange's equations of L and the generalised forces are the elements' m q'' = F."""
        lagrangian = self.value("L")
        for n in self.m.masses:
            inertia, slope = lagrangian.diff(self.m.v[n], 2), lagrangian.diff(self.m.x[n])
            yield f"force_{n}", inertia * self.m.acceleration[n] - slope - self.value(f"force_{n}")
            yield f"acc_{n}", self.value(f"acc_{n}") - self.m.acceleration[n]

    def obeys(self) -> Iterator[Residual]:
        """X and V of the states over time are s X - x(0) = V, and s V - v(0) the transform of the elements' F/m."""
        s, inputs, at = self.s, self.m.inputs, dict[sp.Symbol, sp.Expr]()
        for n in self.m.masses:
            slips = n in self.moving
            at[self.m.x[n]] = self.motion[f"x{n}_t"] if slips else inputs[f"x{n}_0"] / s
            at[self.m.v[n]] = self.motion[f"v{n}_t"] if slips else sp.S.Zero
        for n in self.moving:
            acceleration = sp.expand(self.m.acceleration[n])
            constant = acceleration.subs(dict.fromkeys(at, sp.S.Zero))
            pull = constant / s + sum(acceleration.diff(symbol) * own for symbol, own in at.items())
            yield f"x{n}_t", self.crossed(s * at[self.m.x[n]] - inputs[f"x{n}_0"], at[self.m.v[n]])
            yield f"v{n}_t", self.crossed(s * at[self.m.v[n]] - inputs[f"v{n}_0"], pull)

    def transforms(self) -> Iterator[Residual]:
        """X_n(s) is the transform of x_n(t); with both masses also by each other."""
        for n in self.moving:
            yield f"X{n}", self.crossed(self.value(f"X{n}"), self.motion[f"x{n}_t"])
        if self.both:
            x_1, x_2 = (self.motion[f"x{n}_t"] for n in (1, 2))
            of_2, of_1 = self.value("X1_by_X2", "X2"), self.value("X2_by_X1", "X1")
            yield "X1_by_X2", self.crossed(of_2.xreplace({self.symbol("X2"): x_2}), x_1)
            yield "X2_by_X1", self.crossed(of_1.xreplace({self.symbol("X1"): x_1}), x_2)
            yield "Z", of_2 - of_2.xreplace({self.symbol("X2"): sp.S.Zero}) - self.value("Z", "X2")

    def fractions(self) -> Iterator[Residual]:
        """The partial fractions add up to X_n(s), over (s + a)(s^2 + p s + q)."""
        s, (a, p, q) = self.s, (self.symbol(key) for key in ("a", "p", "q"))
        by_poles = dict(
            zip(
                map(str, POLYNOMIALS[self.moving]),
                (a + p, q + a * p, a * q) if self.both else (a, 0) if self.integrates else (p, q),
                strict=True,
            )
        )
        known = {self.symbol(key): value for key, value in by_poles.items() if key in self.by_key}
        for n in self.moving:
            hat = "_hat" if n == 1 else ""
            letters, tops = [f"{each}{hat}" for each in "ABCDE"], [f"H{power}{hat}" for power in (4, 3, 2, 1)]
            if f"A{hat}" not in self.by_key:
                continue  # a pole at 0 whatever the robot
            stop = (*tops, *by_poles, "a", "p", "q", f"A{hat}", f"B{hat}", f"C{hat}")
            A, B, C = (self.symbol(each) for each in letters[:3])
            D, E = (self.value(each, *stop).xreplace(known) for each in letters[3:])
            pair = 1 if self.integrates else s**2 + p * s + q
            real = s + a if self.both or self.integrates else 1
            top, bottom = sp.fraction(self.value(f"X{n}", *tops, *by_poles).xreplace(known))
            added = (A * s + B) * real * pair + C * s**2 * pair + (D * s + E) * s**2 * real
            residual = sp.expand(added * bottom - top * s**2 * real * pair)
            for each in letters[:3]:
                residual = residual.xreplace({self.symbol(each): self.value(each, *stop[:-3]).xreplace(known)})
            yield f"A{hat}", residual

    def kernels(self) -> Iterator[Residual]:
        """W, its integrals and derivative, and those of R and exp(-a t) case by case."""
        s, (a, p, q) = self.s, (self.symbol(key) for key in ("a", "p", "q"))
        pair = s**2 + p * s + q
        known = dict(zip(("Rd", "R", "R1", "R2"), (s / pair, 1 / pair, 1 / (s * pair), 1 / (s**2 * pair)), strict=True))
        known |= {key: 1 / (s**n * (s + a)) for n, key in enumerate(("e", "e1", "e2"))}
        P = (s + a) * pair if self.both else s * (s + a) if self.integrates else pair
        powers = range(-1, 3) if self.both else range(4)
        of_w = dict(zip(("Wd", "W", "W1", "W2"), powers, strict=True))
        for key in filter(self.by_key.__contains__, of_w):
            *limits, quotient = self._cases(key)
            yield key, self.transform(self.unfolded(quotient, *known, "a", "p", "q"), known) - 1 / (P * s ** of_w[key])
            for (
                limit
            ) in limits:  # where all three poles are one, because -a is the one that is farthest from their mean
                names, rates = ("s_1", "s_2", "s_3"), (3 * a, 3 * a**2, a**3)
                triple = {each: 1 / ((s + a) ** 3 * s**power) for each, power in of_w.items()}
                value = self.transform(self.unfolded(limit, *of_w, "a", *names), triple, a) - triple[key]
                yield key, value.xreplace(dict(zip(map(self.symbol, names), rates, strict=True)))
        if "e" in self.by_key:
            yield "e", self.by_key["e"].value - sp.exp(-a * self.t)
            yield from self._decay(a, known, "e")
        if "R" in self.by_key:
            yield from self._pair(known, p, q)

    def _pair(self, known: Mapping[str, sp.Expr], p: sp.Expr, q: sp.Expr) -> Iterator[Residual]:
        """R'' + p R' + q R = 0 from 0 and 1 of a pair that rings, of two real poles r < f, and of a double one."""
        s, t, w, slow = self.s, self.t, self.symbol("w"), self.symbol("slow")
        squares = p**2 / 4 + w**2, p**2 / 4 - w**2, p**2 / 4
        for R, Rd, square in zip(self._cases("R"), self._cases("Rd"), squares, strict=True):
            yield "R", (R.diff(t) - Rd).rewrite(sp.exp)
            yield "Rd", (Rd.diff(t) + p * Rd + square * R).rewrite(sp.exp)
            yield from (("R", R.subs(t, 0)), ("Rd", Rd.subs(t, 0) - 1))
        yield "disc", self.value("disc", "p", "q") - p**2 / 4 + q
        yield "w", self.value("w", "disc") - sp.sqrt(sp.Abs(self.symbol("disc")))
        of_slow = {"slow1": 1 / (s * (s + slow)), "slow2": 1 / (s**2 * (s + slow))}
        yield from self._decay(slow, of_slow, "slow")
        of_turned = 1 / s - (s + p) / (s**2 + p * s + q)
        yield "turned", self.transform(self.value("turned", "Rd", "R", "p"), known) - of_turned
        known = {**known, **of_slow, "turned": of_turned}
        r, f = sp.Dummy("r"), sp.Dummy("f")
        real = {p: r + f, q: r * f, w: (f - r) / 2, slow: r}
        if p != 0:  # what is undamped has no real poles
            yield "slow", (self._cases("slow")[0] - slow).xreplace(real)
        for key in ("R1", "R2"):
            split, quotient, limit = self._cases(key)
            if p != 0:
                yield key, (self.transform(split, known) - known[key]).xreplace(real)
            yield key, self.transform(quotient, known) - known[key]
            yield key, self.transform(limit, {}) - known[key].xreplace({p: sp.S.Zero, q: sp.S.Zero})

    def _cases(self, key: str) -> list[sp.Expr]:
        """The cases of a formula."""
        value = self.by_key[key].value
        return [each for each, _ in value.args] if isinstance(value, sp.Piecewise) else [value]

    def _decay(self, rate: sp.Expr, known: Mapping[str, sp.Expr], name: str) -> Iterator[Residual]:
        """The integrals of exp(-rate t): the quotient, and the limit at a rate of 0."""
        for key in (f"{name}1", f"{name}2"):
            limit, *quotients = self._cases(key) if rate != 0 else [self.by_key[key].value]
            yield key, self.transform(limit, {}) - known[key].xreplace({rate: sp.S.Zero})
            yield from ((key, self.transform(quotient, known, rate) - known[key]) for quotient in quotients)

    def join(self) -> Iterator[Residual]:
        """At t = 0 the state is that at the start; each kernel, case by case, is 0 there, but exp(-a t) and R' are 1."""
        kernels = [key for key in KERNELS if key in self.by_key]
        start = {self.symbol(key): sp.Integer(key in ("e", "Rd")) for key in kernels} | {self.t: sp.S.Zero}
        for key in (f"{letter}{n}" for n in self.moving for letter in "xv"):
            yield f"{key}_t", self.value(f"{key}_t", *kernels).subs(start) - self.m.inputs[f"{key}_0"]
        yield from ((key, case.subs(start) - start[self.symbol(key)]) for key in kernels for case in self._cases(key))

    def poles(self) -> Iterator[Residual]:
        """(s + a)(s^2 + p s + q) = P(s); the real pole -a is a root of P in each case of the formula of three angles."""
        names = tuple(map(str, POLYNOMIALS[self.moving]))
        if not self.both:
            keys = ("a", "") if self.integrates else ("p", "q")
            yield from ((key or "a", self.value(key) - self.value(rate)) for key, rate in zip(keys, names, strict=True))
            return
        (s_1, s_2, s_3), a = map(self.symbol, names), self.symbol("a")
        p, q = (self.value(key, *names, "a") for key in ("p", "q"))
        yield from (("p", a + p - s_1), ("q", q + a * p - s_2))
        if "sigma" not in self.by_key:  # a root at 0 whatever the robot
            yield "s_3", self.value("s_3") + a
            return
        z, Q_s, T_s, apart = sp.Dummy("z"), *map(self.symbol, ("Q_s", "T_s", "apart"))
        sigma, linear, constant = (self.value(key, *names) for key in ("sigma", "Q_s", "T_s"))
        cubic = sp.Poly((z - sigma) ** 3 + s_1 * (z - sigma) ** 2 + s_2 * (z - sigma) + s_3, z)
        shifted = sp.Poly(z**3 + linear * z + constant, z)
        yield from zip(
            ("sigma", "sigma", "Q_s", "T_s"),
            [a - b for a, b in zip(cubic.all_coeffs(), shifted.all_coeffs(), strict=True)],
            strict=True,
        )
        (at_zero, where), (isolated, _) = self.by_key["a"].value.args
        yield from (("a", at_zero), ("a", where.lhs - s_3))  # a is 0 where P(0) is
        for (case, _), sign in zip(sp.piecewise_fold(isolated).args, (1, -1), strict=True):  # by the sign of T_s
            yield "a", case - self.symbol("sigma") - sign * apart
        yield from (("apart", residual) for residual in self._angles(Q_s, T_s))

    def _angles(self, Q_s: sp.Symbol, T_s: sp.Symbol) -> Iterator[sp.Expr]:
        """z^3 + Q z = |T| with |Q| = 3 size^2, |T| = 2 size^3 r: r is sinh, cosh or sin of 3 angles, z in terms of one."""
        (alone, _), *others = self.by_key["apart"].value.args
        yield alone**3 - sp.Abs(T_s)
        size, r, angle = (sp.Dummy(name, positive=True) for name in ("size", "r", "angle"))
        inverse = {sp.asinh(r): 3 * angle, sp.asin(r): 3 * angle, sp.sqrt(sp.Abs(1 - r**2)): sp.sinh(3 * angle)}
        for (case, _), sign, of_angle in zip(others, (1, -1, -1), (sp.sinh, sp.cosh, sp.sin), strict=True):
            linear, constant, whole = 3 * sign * size**2, 2 * size**3 * r, of_angle(3 * angle)
            sizes = {sp.Abs(Q_s): sp.Abs(linear), Q_s: linear, sp.Abs(T_s): constant, T_s: constant}
            z = case.xreplace(sizes).xreplace(inverse).xreplace({r: whole})
            yield (z**3 + linear * z - constant.xreplace({r: whole})).rewrite(sp.exp)

    def ledger(self) -> Iterator[Residual]:
        """The energy's rate along the elements' equations is the sum of the powers, and each power is its elements'."""
        powers = {key_of(entry, "power"): power for entry, power in self.m.powers.items()}
        names = [key for key in self.by_key if key in powers]
        held = {self.m.v[n]: sp.S.Zero for n in self.m.masses if n not in self.moving}

        def rate(value: sp.Expr) -> sp.Expr:
            along = sum((value.diff(self.m.v[n]) * self.m.acceleration[n] for n in self.m.masses), self.m.rate(value))
            return along.xreplace(held)

        entries = sum((self.value(key).xreplace(held) for key in names if key != "spring_power"), sp.S.Zero)
        yield "total", rate(self.value("total")) - entries
        if "aed_power" in self.by_key:
            yield "aed_power", rate(self.value("body")) - self.value("aed_power").xreplace(held)
        yield from ((key, self.value(key) - powers[key]) for key in names)


def is_zero(value: sp.Expr) -> bool:
    """Whether an expression is 0 for all its symbols: its numerator, multiplied out."""
    value = sp.sympify(value)
    if value.has(sp.exp):
        value = sp.powsimp(sp.expand(value))
    return bool(sp.expand(sp.numer(sp.together(value))) == 0)
