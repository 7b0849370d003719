"""From what a file declares to what the engine carries: two masses in series with one spring line, or one mass on a
spring to the ground. Anything else is refused by name.

Each mode must have at most one real pole, one pair and integrators. So a coordinate has an inertia, forces are
linear, and of two coordinates that move, springs and dampers tie one combination alone, ratio x_1 - x_2, the ratio
being 1 or that of a gear, a rope or levers.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations

import sympy as sp

from ..ir import DOMAINS, Own, Parameter
from . import quantities as Q
from . import units
from .declare import Coordinate, Current, DeclaredCoordinate, DeclaredCurrent, Draft, Element, glyph_of
from .equations import EXCESSES, Force, Input, Law, Listed, Model, ModelError, Named

SMALLEST, LARGEST = sp.Rational(1, 10**30), sp.Integer(10**30)
"""Numbers in an expression, so that single precision holds what becomes of them."""

MOST_TRIED = 6
"""[B] the most coordinates that move of a model whose order is computed, and for which is tried what may be held."""

FINITE = ("real", "positive", "nonnegative", "fraction")
"""Domains of parameters that may stand in an expression."""


def model_of(draft: Draft, name: str, title: str, text: str = "") -> Model:
    """The model of a draft; ModelError, which names the element, for one that is not carried."""
    return _Mechanism(draft).model(name, title, text)


_Declared = Element | DeclaredCoordinate | DeclaredCurrent
"""What a refusal is about, which has a line."""


def _refused(declared: _Declared, message: str) -> ModelError:
    """A refusal of what is declared, with its line of the file."""
    return ModelError(message, declared.line)


@dataclass(frozen=True)
class _Stretch:
    """What a spring or damper acts on: y of ratio x_1 - x_2 (or of x_1) times a factor, and an offset of that."""

    factor: sp.Expr
    offset: sp.Expr


_NOT_NEGATIVE = ("positive", "nonnegative", "fraction", "bound", "length")
"""Domains of parameters that are never negative."""


class _Mechanism:
    def __init__(self, draft: Draft, *, is_tried: bool = False) -> None:
        self.is_tried = is_tried
        self.draft = draft
        self.parameters = {each.symbol: each for each in draft.parameters}
        self.input = draft.currents[0] if draft.currents else None
        self.constants: dict[sp.Symbol, sp.Expr] = dict.fromkeys(Q.LETTERS, sp.S.Zero)
        self.constants |= {
            Q.m_eff: sp.S.One,
            Q.m_s: sp.S.One,
            Q.ratio: sp.S.One,
            Q.x1_min: -sp.oo,
            Q.x1_max: sp.oo,
            Q.u_max: sp.oo,
        }
        self.sources: dict[sp.Symbol, str] = {}
        self.elements: dict[sp.Symbol, tuple[str, ...]] = {}
        self.weights = [sp.S.Zero, sp.S.Zero]
        self.further: list[Force] = []
        self.of_further: list[tuple[Element, Force]] = []
        self.by_sign = [False, False]
        self.undone: Element | None = None
        self.rest_may_lack = False

    # ---- the whole ----

    def model(self, name: str, title: str, text: str) -> Model:
        if not self.draft.coordinates:
            raise ModelError("the file declares no coordinate: `q = coordinate(NAME, UNIT, INERTIA)` makes one")
        if not self.draft.elements:
            raise ModelError("the file declares no element: a spring, a force, friction")
        self._check_expressions()
        self._check_units()
        self.contact = self._the("contact")
        self.first, self.second = self._masses()
        self.alone = self.second is None
        self._put_inertias()
        self._put_ratio()
        self._put_springs()
        self._put_forces()
        self._put_friction()
        self._put_stops()
        self._put_contact()
        law = self._law()
        parameters = self._parameters()
        self._refuse_hidden(parameters)
        return Model(
            parameters, self.constants, (_named(self.first), _named(self.second)), self._input(law),
            tuple(self.further), self.contact is not None, self.alone, (self.by_sign[0], self.by_sign[1]),
            self.rest_may_lack, law, (self.weights[0], self.weights[1]), self.sources, self.elements, tuple(self._listed(parameters)), name, title, text,
        )  # fmt: skip

    def _the(self, kind: str) -> Element | None:
        return next((each for each in self.draft.elements if each.kind == kind), None)

    def _of(self, *kinds: str) -> Iterator[Element]:
        """The elements of some kinds that act on what moves."""
        for element in self.draft.elements:
            if element.kind in kinds and (element.kind == "contact" or self._moving(element.on)):
                yield element

    def _declared(self, symbol: sp.Symbol) -> DeclaredCoordinate:
        return next(each for each in self.draft.coordinates if each.symbol == symbol)

    def _moving(self, on: sp.Expr) -> list[sp.Symbol]:
        """The coordinates of an expression that are not held."""
        return [c.symbol for c in self.draft.coordinates if c.symbol in on.free_symbols and not c.held]

    # ---- expressions ----

    def _expressions(self) -> Iterator[tuple[_Declared, str, sp.Expr]]:
        for coordinate in self.draft.coordinates:
            yield coordinate, f"the inertia of {coordinate.symbol}", coordinate.inertia
        if self.input is not None and self.input.limit is not None:
            yield self.input, f"the limit of {self.input.symbol}", self.input.limit
        for element in self.draft.elements:
            yield element, f"{element}", element.on
            for key, value in element.values.items():
                if value is not None:
                    yield element, f"{element}: {key}", value

    def _check_expressions(self) -> None:
        symbols = {*self.parameters, *(each.symbol for each in self.draft.coordinates)}
        symbols |= {each.symbol for each in self.draft.currents}
        coordinates = {each.symbol for each in self.draft.coordinates}
        for declared, what, value in self._expressions():
            if unknown := sorted(map(str, value.free_symbols - symbols)):
                raise _refused(
                    declared,
                    f"{what} is {_short(value)}, and {', '.join(unknown)} is not declared: symbols are what "
                    "`parameter`, `coordinate` and `current` return",
                )
            _exact(declared, value, f"{what} is {_short(value)}")
            for symbol in value.free_symbols & self.parameters.keys():
                domain = self.parameters[symbol].domain
                if domain not in FINITE and not (
                    value == symbol and what.endswith((": low", ": high")) or "limit of" in what
                ):
                    raise _refused(
                        declared,
                        f"{what} reads {symbol}, which may be infinite: its domain {domain!r} is for an end of a stop, "
                        "or the limit of the current",
                    )
        for element in self.draft.elements:
            if not element.on.free_symbols & coordinates:
                raise _refused(element, f"{element} acts on {_short(element.on)}, which has no coordinate")
            for key, value in element.values.items():
                if value is None:
                    continue
                if moved := sorted(value.free_symbols & coordinates, key=str):
                    raise _refused(
                        element,
                        f"{element}: {key} is {_short(value)}, which changes with {', '.join(map(str, moved))}"
                        f"{self._way_as_spring(element, value, moved)}; the Laplace transform needs a linear "
                        "equation in each phase: a value is constant, a force may be linear in the current",
                    )
                if element.kind not in ("force", "torque") and self.input is not None:
                    self._refuse_input(element, key, value)

    def _way_as_spring(self, element: Element, value: sp.Expr, moved: list[sp.Symbol]) -> str:
        """What a force on a coordinate is declared as that falls in proportion to this coordinate."""
        slope = sp.diff(value, element.on) if moved == [element.on] else None
        if element.kind not in ("force", "torque") or slope is None or element.on in slope.free_symbols:
            return ""
        if not self._never_negative(-slope):
            return ""
        constant = sp.expand(value - slope * element.on)
        beside = f" and {element.kind}({element.on}, {_short(constant)})" if constant != 0 else ""
        return f": declare spring({element.on}, {_short(-slope)}){beside}"

    def _refuse_input(self, element: Element, key: str, value: sp.Expr) -> None:
        if self.input is not None and self.input.symbol in value.free_symbols:
            raise _refused(
                element, f"{element}: {key} is {_short(value)}: the current may stand in a force or torque alone"
            )

    def _check_units(self) -> None:
        """Units that a file gives, where all of them are known."""
        dimensions = {symbol: units.dimension(each.unit) for symbol, each in self.parameters.items()}
        dimensions |= {
            each.symbol: units.dimension("m" if each.unit == "m" else "1") for each in self.draft.coordinates
        }
        if self.input is not None:
            dimensions[self.input.symbol] = units.dimension(self.input.unit)
        unit_of: dict[str, str] = {}
        for axis in self.draft.coordinates:
            _fits(
                axis, axis.inertia, "kg" if axis.unit == "m" else "kg m^2", dimensions, f"the inertia of {axis.symbol}"
            )
            unit_of[axis.symbol.name] = axis.unit
        if self.input is not None and self.input.limit is not None:
            _fits(self.input, self.input.limit, self.input.unit, dimensions, f"the limit of {self.input.symbol}")
        for element in self.draft.elements:
            self._check_units_of(element, dimensions, unit_of)

    def _check_units_of(
        self, element: Element, dimensions: dict[sp.Symbol, units.Dimension | None], unit_of: dict[str, str]
    ) -> None:
        where = [unit_of[str(symbol)] for symbol in element.on.free_symbols if str(symbol) in unit_of]
        turns = where == ["rad"]
        effort = "N m" if turns else "N"
        values = {key: value for key, value in element.values.items() if value is not None}
        if element.kind in ("force", "torque"):
            unit_of_push = "rad" if element.kind == "torque" else "m"
            if where and where[0] != unit_of_push:
                other = "torque" if element.kind == "force" else "force"
                raise _refused(
                    element, f"{element} acts along {element.on}, which is in {where[0]}: declare it as {other}(...)"
                )
        if element.kind == "gravity" and turns:
            raise _refused(
                element, f"{element} acts along {element.on}, which is in rad: declare its torque, or spring(...)"
            )
        expected = {
            "force": {"value": effort}, "torque": {"value": effort}, "gravity": {"acceleration": "m/s^2"},
            "friction": dict.fromkeys(("forward", "backward", "forward_at_rest", "backward_at_rest"), effort),
            "stop": dict.fromkeys(("low", "high"), "rad" if turns else "m"), "contact": {"impact_loss": "1"},
            "law": {"proportional": f"{effort}/{'rad' if turns else 'm'}",
                    "derivative": f"{effort} s/{'rad' if turns else 'm'}"},
        }  # fmt: skip
        for key, unit in expected.get(element.kind, {}).items():
            if key in values:
                _fits(element, values[key], unit, dimensions, f"{element}: {key}")
        if element.kind not in ("spring", "viscous") or not where:
            return
        self._slopes(element)
        what = f"{element}: {element.on}"
        try:
            stretch = units.of_expression(sp.expand(element.on), dimensions)
        except units.UnitError as error:
            raise _refused(element, f"{what}: units do not fit: {error}") from None
        (key, value), *_ = values.items()
        dimension = _dimension_of(element, value, dimensions, f"{element}: {key}")
        if stretch is None or dimension is None or not value.free_symbols:
            return
        # the force along a coordinate is (d stretch/d q) times stiffness times stretch
        power = [each + 2 * other for each, other in zip(dimension, stretch, strict=True)]
        energy = units.dimension("J")
        assert energy is not None
        if element.kind == "viscous":
            power[2] -= 1
        if tuple(power) != energy:
            unit = {"spring": "stiffness", "viscous": "damping"}[element.kind]
            per = "rad" if units.spelled(stretch) == "1" else units.spelled(stretch)
            rate = " s" if element.kind == "viscous" else ""
            fits = "N m" if per == "rad" else "N"
            has = self.parameters[value].unit if value in self.parameters else units.spelled(dimension)
            raise _refused(
                element,
                f"{element}: {unit} {_short(value)} is in {has}, and of a stretch in {per} it must be in {fits}{rate}/{per}",
            )

    # ---- which mass is which ----

    def _masses(self) -> tuple[DeclaredCoordinate | None, DeclaredCoordinate | None]:
        """The coordinates of masses 1 and 2: that of the current and of stops, and that which falls."""
        moving = [each for each in self.draft.coordinates if not each.held]
        if not moving:
            raise _refused(self.draft.coordinates[-1], "every coordinate is held: nothing moves")
        for coordinate in moving:
            self._refuse_sign(coordinate, coordinate.inertia, f"the inertia of {coordinate.symbol}", positive=True)
        if len(moving) > 2:
            extra = _short(", ".join(str(each.symbol) for each in moving))
            order = f": with nothing held the motion is of {self._order()}" if len(moving) <= MOST_TRIED else ""
            raise _refused(
                moving[2],
                f"{len(moving)} coordinates move, {extra}{order}; what is carried are two that move, of order 3 and an "
                f"integrator at most{self._by_holding()}",
            )
        if len(moving) == 1:
            if self.contact is None:
                return moving[0], None
            if any(self._moving(each.on) for each in self.draft.elements if each.kind == "stop") or self._driven():
                raise _refused(
                    self.contact,
                    f"{self.contact}: of a leg with one coordinate that moves, {moving[0].symbol}, that is the body, "
                    "which may have neither stops nor a current",
                )
            return None, moving[0]
        driven, stopped = (
            self._driven(),
            {s for e in self.draft.elements if e.kind == "stop" for s in self._moving(e.on)},
        )
        falling = {s for e in self.draft.elements if e.kind == "gravity" for s in self._moving(e.on)}
        for symbols, what, kinds in (
            (driven, "the current acts on", ("force", "torque")),
            (stopped, "there are stops on", ("stop",)),
        ):
            if len(symbols) > 1:
                last = [each for each in self._of(*kinds) if {*self._moving(each.on)} & symbols][-1]
                names = " and ".join(sorted(map(str, symbols)))
                raise _refused(last, f"{what} {names}: it may be one coordinate alone")
        if driven and stopped and driven != stopped:
            raise _refused(
                [*self._of("stop")][-1],
                f"the current acts on {next(iter(driven))}, and {next(iter(stopped))} has stops: of two coordinates "
                "that move one alone may have both",
            )
        chosen = driven or stopped
        if not chosen and len(falling) == 1:
            chosen = {each.symbol for each in moving} - falling
        one = next((each for each in moving if each.symbol in chosen), moving[0])
        return one, next(each for each in moving if each is not one)

    def _driven(self) -> set[sp.Symbol]:
        if self.input is None:
            return set()
        return {
            symbol
            for each in self.draft.elements
            if each.kind in ("force", "torque")
            and self.input.symbol in (each.values["value"] or sp.S.Zero).free_symbols
            for symbol in self._moving(each.on)
        }

    def _number(self, symbol: sp.Symbol) -> int:
        """The mass of a coordinate that moves: 1 or 2."""
        return 1 if self.first is not None and symbol == self.first.symbol else 2

    def _one(self, element: Element) -> int:
        """The mass that an element on one coordinate acts on."""
        if not (element.on.is_Symbol and isinstance(element.on, Coordinate)):
            raise _refused(element, f"{element} acts on {_short(element.on)}: it must be a coordinate")
        return self._number(element.on)

    # ---- letters ----

    def _put(self, declared: _Declared, letter: sp.Symbol, value: sp.Expr, source: str) -> None:
        self.constants[letter] = _exact(declared, value, source)
        self.sources[letter] = source
        if isinstance(declared, Element):
            self.elements[letter] = tuple(dict.fromkeys((*self.elements.get(letter, ()), declared.name)))

    def _put_inertias(self) -> None:
        for letter, coordinate in ((Q.m_eff, self.first), (Q.m_s, self.second)):
            if coordinate is not None:
                self._refuse_sign(coordinate, coordinate.inertia, f"the inertia of {coordinate.symbol}", positive=True)
                self._put(coordinate, letter, coordinate.inertia, f"inertia of {coordinate.symbol}")

    def _slopes(self, element: Element) -> dict[sp.Symbol, sp.Expr]:
        """How a stretch changes with each coordinate that moves, constants; ModelError where it is not linear."""
        on = sp.expand(element.on.subs({each.symbol: 0 for each in self.draft.coordinates if each.held}))
        slopes = {symbol: sp.diff(on, symbol) for symbol in self._moving(element.on)}
        for symbol, slope in slopes.items():
            if slope.free_symbols & {*slopes, *({self.input.symbol} if self.input else ())}:
                raise _refused(
                    element,
                    f"{element} is not linear: {_short(element.on)} changes with {symbol} by {_short(slope)}; the "
                    "Laplace transform needs a linear equation in each phase",
                )
        return {symbol: slope for symbol, slope in slopes.items() if slope != 0}

    def _stretch(self, element: Element) -> _Stretch:
        """A stretch as a factor of y and an offset; of one mass y is its coordinate."""
        slopes = self._slopes(element)
        at_0 = {each.symbol: 0 for each in self.draft.coordinates}
        offset = sp.expand(element.on.subs(at_0))
        if self.input is not None and self.input.symbol in offset.free_symbols:
            raise _refused(
                element, f"{element}: {_short(element.on)} has the current in it, which may stand in a force alone"
            )
        if not slopes:
            raise _refused(
                element, f"{element} acts on {_short(element.on)}, which does not change with any coordinate"
            )
        if len(slopes) == 2:
            assert self.first is not None and self.second is not None
            if _cancelled(self._ratio_of(slopes) - self.constants[Q.ratio]) != 0:
                raise _refused(
                    element,
                    f"{element} acts on {_short(element.on)}, which changes where {self.first.symbol} and "
                    f"{self.second.symbol} move as the other springs and dampers between them let them, and what is carried "
                    f"moves freely as a whole: with nothing held the motion is of {self._order()}{self._by_holding()}",
                )
            return _Stretch(-slopes[self.second.symbol], offset)
        (symbol,) = slopes
        if not self.alone and self.first is not None:
            if element.kind == "viscous":
                return _Stretch(slopes[symbol], offset)
            order, without = self._order(), self._order(element)
            because = f", because of '{element.name}', without which it is of {without}" if order != without else ""
            raise _refused(
                element,
                f"{element} ties {symbol} to the ground while {self._other(symbol)} moves, too: with nothing held the "
                f"motion is of {order}{because}; what is carried has at most order 3 and an integrator{self._by_holding()}",
            )
        factor = slopes[symbol] if self.alone else -slopes[symbol]  # mass 2 is at the other end
        return _Stretch(factor, offset)

    def _ratio_of(self, slopes: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
        """By how much a stretch between two coordinates changes per x_1, where it changes by -1 per x_2."""
        assert self.first is not None and self.second is not None
        return _cancelled(-slopes[self.first.symbol] / slopes[self.second.symbol])

    @property
    def _ratio(self) -> sp.Expr:
        """The letter of the gear, or 1 without one."""
        return Q.ratio if Q.ratio in self.sources else sp.S.One

    def _put_ratio(self) -> None:
        """The ratio of the gear or rope that the first spring between two coordinates stretches through."""
        between = (each for each in self._of("spring") if len(self._slopes(each)) == 2)
        spring = next(between, None)
        if spring is None or (ratio := self._ratio_of(self._slopes(spring))) == 1:
            return
        if self.contact is not None:
            assert self.first is not None
            raise _refused(
                spring,
                f"{spring} acts on {_short(spring.on)}: in a leg with a contact the actuator has the factor 1 against the "
                f"body{self._behind_the_gear(spring)}",
            )
        if not self._is_positive(-ratio):
            self._refuse_sign(spring, ratio, f"{spring}: the ratio of its coordinates", positive=True)
        self._put(spring, Q.ratio, ratio, f"gear of spring {spring.name}")

    # ---- the order of a motion that is not carried ----

    def _order(self, without: Element | None = None) -> str:
        """The order of the motion with nothing held, in words: the degree of det(M s^2 + D s + K) less its roots at 0,
        the integrators.

        In exact arithmetic, with a prime in place of each parameter: what vanishes there vanishes for all robots, but
        for a chance that is smaller than 1e-3.
        """
        moving = [each for each in self.draft.coordinates if not each.held]
        primes = {symbol: sp.Integer(sp.prime(1000 + n)) for n, symbol in enumerate(self.parameters)}

        def number(value: sp.Expr) -> sp.Expr:
            return sp.nsimplify(value, rational=True).xreplace(primes)

        size = len(moving)
        of_kind = {"spring": sp.zeros(size), "viscous": sp.zeros(size)}
        for element in self._of("spring", "viscous"):
            if element is not without:
                slopes = self._slopes(element)
                along = sp.Matrix([number(slopes.get(each.symbol, sp.S.Zero)) for each in moving])
                (value,) = element.values.values()
                assert value is not None
                of_kind[element.kind] += number(value) * along * along.T
        inverse = sp.diag(*(1 / number(each.inertia) for each in moving))
        first_order = sp.Matrix.vstack(
            sp.Matrix.hstack(sp.zeros(size), sp.eye(size)),
            sp.Matrix.hstack(-inverse * of_kind["spring"], -inverse * of_kind["viscous"]),
        )
        coefficients = first_order.charpoly().all_coeffs()
        integrators = next(n for n, each in enumerate(reversed(coefficients)) if each != 0)
        more = {0: "", 1: " and an integrator"}.get(integrators, f" and {integrators} integrators")
        return f"order {len(coefficients) - 1 - integrators}{more}"

    def _behind_the_gear(self, element: Element) -> str:
        """Which coordinate to take in place of the first one, so that a stretch is a difference; "" if others are not.

        Of x = r q the inertia is J/r^2, and a force along q is 1/r times as large.
        """
        assert self.first is not None and self.second is not None
        q = self.first.symbol

        def ratio(slopes: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
            return sp.cancel(-slopes.get(q, sp.S.Zero) / slopes[self._other(q)])

        between = [self._slopes(each) for each in self._of("spring", "viscous")]
        r = ratio(self._slopes(element))
        if any(
            q not in each or len(each) == 2 and sp.cancel(ratio(each) - r) != 0
            for each in between
            if each.keys() != {q}
        ):
            return ""
        if any(self._slopes(each).keys() == {q} for each in self._of("spring")):
            return ""
        per, inertia = sp.cancel(1 / r), sp.cancel(self.first.inertia / r**2)
        unit = f" [{self.second.unit}]" if self.second.unit != self.first.unit else ""
        return (
            f"; take {_short(r * q)}{unit} as the coordinate in place of {q}, with the inertia {_short(inertia)}: forces "
            f"along it are those along {q} times {_short(per)}, dampings times {_short(per**2)}, lengths times {_short(r)}"
        )

    def _by_holding(self) -> str:
        """What to hold so that the model is carried: the fewest coordinates, found by trying; "" if there are none."""
        moving = [each for each in self.draft.coordinates if not each.held]
        if self.is_tried or len(moving) > MOST_TRIED:
            return ""
        for count in range(max(1, len(moving) - 2), len(moving)):
            for held in combinations(moving, count):
                coordinates = [replace(each, held=each.held or each in held) for each in self.draft.coordinates]
                try:
                    _Mechanism(replace(self.draft, coordinates=coordinates), is_tried=True).model("", "", "")
                except ModelError:
                    continue
                return f"; it is carried with {' and '.join(str(each.symbol) for each in held)} held (held=True)"
        return ""

    def _other(self, symbol: sp.Symbol) -> sp.Symbol:
        return next(c.symbol for c in self.draft.coordinates if not c.held and c.symbol != symbol)

    def _put_springs(self) -> None:
        springs = list(self._of("spring"))
        for spring in springs:
            self._refuse_sign(spring, spring.values["stiffness"], f"{spring}: stiffness", positive=False)
        leg = self.contact.on if self.contact is not None else None
        if self.contact is not None and not any(each.on == leg for each in springs):
            raise _refused(self.contact, f"{self.contact}: the spring of its leg stretches nothing that moves")
        solid = not self.alone  # what is divided by the stiffness
        if self.first is not None and self.second is not None:
            self._refuse_what_nothing_ties(self.first, self.second)
        main = next((each for each in springs if each.on == leg), None)
        main = main or next((each for each in springs if self._is_positive(each.values["stiffness"])), None)
        main = main or next(iter(springs), None)
        if main is None:
            return
        stretch, stiffness = self._stretch(main), main.values["stiffness"]
        assert stiffness is not None
        if solid:
            self._refuse_sign(main, stiffness, f"{main}: stiffness", positive=True)
        self._put(main, Q.k, _cancelled(stiffness * stretch.factor**2), f"spring {main.name}")
        offset = _cancelled(stretch.offset / stretch.factor)
        pulled = self._offset_force(stiffness, offset)
        if self.undone is not None:
            self._put(main, Q.c, pulled, f"spring {main.name}")
        self._put(main, Q.L0, sp.expand(offset - pulled), f"spring {main.name}")
        for spring in springs:
            if spring is main:
                continue
            stretched, k = self._stretch(spring), spring.values["stiffness"]
            assert k is not None
            positions = Q.x1 if self.alone else self._ratio * Q.x1 - Q.x2
            push = -k * stretched.factor * (stretched.factor * positions + stretched.offset)
            self._further(spring, self._ratio * push, sp.S.Zero if self.alone else -push)

    def _refuse_what_nothing_ties(self, first: DeclaredCoordinate, second: DeclaredCoordinate) -> None:
        between = {each.kind for each in self._of("spring", "viscous") if len(self._slopes(each)) == 2}
        if "spring" not in between:
            but = " but for dampers" if between else ""
            raise _refused(
                second,
                f"nothing ties {first.symbol} to {second.symbol}{but}: two coordinates that move need a spring between "
                f"them, or are two models{self._by_holding()}",
            )

    def _offset_force(self, stiffness: sp.Expr, offset: sp.Expr) -> sp.Expr:
        """The share of a spring's offset that a constant force on mass 1 undoes there, as (3) has it; 0 without one."""
        for element in self._of("force", "torque"):
            share = _cancelled((element.values["value"] or sp.S.Zero) / stiffness)
            if (
                not self.alone and self.constants[Q.ratio] == 1 and share.is_Symbol and self._number(element.on) == 1 and element.where == "both"
                and share in sp.Add.make_args(offset)
            ):  # fmt: skip
                self.undone = element
                return share
        return sp.S.Zero

    def _put_forces(self) -> None:
        self._put_viscous()
        self._put_gravity()
        for element in self._of("force", "torque"):
            value = element.values["value"]
            assert value is not None
            number = self._one(element)
            if element is self.undone:
                continue
            constant, per_unit = self._split(element, value)
            if per_unit != 0:
                if element.where != "both":
                    raise _refused(
                        element, f"{element} has the current in it: it acts in stance and in flight, where='both'"
                    )
                self._put(element, Q.gamma2, self.constants[Q.gamma2] - per_unit, f"{element.kind} {element.name}")
            if constant != 0:
                self._further(element, *((constant, sp.S.Zero) if number == 1 else (sp.S.Zero, constant)))

    def _put_gravity(self) -> None:
        """Weights: energy where the coordinate is a height at all times. In a flight the actuator's counts from the foot, so
        that gravity on it does work there, as a second one on the body.
        """
        for element in self._of("gravity"):
            value, number = element.values["acceleration"], self._one(element)
            assert value is not None
            weight = (Q.m_eff, Q.m_s)[number - 1] * _exact(element, value, f"{element}: acceleration")
            if self.contact is None:
                self.weights[number - 1] += weight
                continue
            if number == 2:
                self._refuse_sign(element, value, f"{element}: acceleration", positive=False)
            if number == 2 and Q.g not in self.sources:
                self._put(element, Q.g, value, f"gravity {element.name}")
                self.weights[1] = Q.m_s * Q.g
            else:
                self._further(element, *((-weight, sp.S.Zero) if number == 1 else (sp.S.Zero, -weight)))

    def _split(self, element: Element, value: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """The constant part of a force, and that per unit of the input."""
        value = sp.expand(value)
        if self.input is None:
            return value, sp.S.Zero
        per_unit = sp.diff(value, self.input.symbol)
        if self.input.symbol in per_unit.free_symbols:
            raise _refused(
                element, f"{element} is {_short(value)}: it must be linear in the current {self.input.symbol}"
            )
        return sp.expand(value - per_unit * self.input.symbol), per_unit

    def _put_viscous(self) -> None:
        for damper in self._of("viscous"):
            damping = damper.values["damping"]
            assert damping is not None
            stretch = self._stretch(damper)
            if stretch.offset != 0:
                raise _refused(
                    damper, f"{damper} acts on {_short(damper.on)}: a velocity knows no {_short(stretch.offset)}"
                )
            symbols = self._moving(damper.on)
            damping = sp.expand(damping * stretch.factor**2)
            if len(symbols) == 2 or self._is_in_leg(damper):
                self._refuse_where(damper, "both", "in the leg" if self.contact else "between two coordinates")
                self._refuse_sign(damper, damping, f"{damper}: damping", positive=False)
                push = -damping * (self._ratio * Q.v1 - Q.v2)
                self._further(damper, self._ratio * push, -push)
                continue
            number = self._number(symbols[0])
            letter, where = ((Q.b1, "both"), (Q.b2, "stance"))[number - 1]
            if self.contact is None:
                where = "both"
            if damper.where == where and letter not in self.sources:
                self._put(damper, letter, damping, f"viscous {damper.name}")
            else:
                push = -damping * (Q.v1, Q.v2)[number - 1]
                self._further(damper, *((push, sp.S.Zero) if number == 1 else (sp.S.Zero, push)))

    def _is_in_leg(self, damper: Element) -> bool:
        """Of a leg with one coordinate that moves: whether a damper is beside its spring, or between the leg's ends."""
        if self.first is not None or self.contact is None:
            return False
        ends = {each.symbol for each in self.draft.coordinates} & self.contact.on.free_symbols
        return damper.beside or (len(ends) == 2 and ends <= damper.on.free_symbols)

    def _refuse_where(self, element: Element, phases: str, why: str) -> None:
        if element.where != phases:
            raise _refused(element, f"{element} acts in {element.where!r}: {why} it must act in {phases!r}")

    def _put_friction(self) -> None:
        for element in self._of("friction"):
            number = self._one(element)
            phases = "stance" if number == 2 and self.contact is not None else "both"
            why = "the friction of a body that flies is" if phases == "stance" else "friction is that"
            if element.where != phases:
                raise _refused(
                    element,
                    f"{element} of {element.on} acts in {element.where!r}: {why} carried in {phases!r} alone, so declare it with "
                    f"where={phases!r}",
                )
            inertia = self.constants[(Q.m_eff, Q.m_s)[number - 1]]
            letters = ((Q.f1, Q.f1_minus), (Q.f2, Q.f2_minus))[number - 1]
            for letter, key in zip(letters, ("forward", "backward"), strict=True):
                level = element.values[key]
                assert level is not None
                self._refuse_sign(element, level, f"{element}: {key}", positive=False)
                self._put(
                    element, letter, self.constants[letter] + _cancelled(level / inertia), f"friction {element.name}"
                )
            for letter, key in zip(EXCESSES[number - 1], ("forward", "backward"), strict=True):
                in_motion, at_rest = element.values[key], element.values[f"{key}_at_rest"]
                assert in_motion is not None and at_rest is not None
                if not (more := sp.expand(at_rest - in_motion)).free_symbols and more < 0:
                    raise _refused(
                        element,
                        f"{element}: {key} at rest is {_short(at_rest)}, less than {_short(in_motion)} in motion",
                    )
                if more != 0:  # else at rest it is that in motion
                    value = self.constants[letter] + _cancelled(more / inertia)
                    self._put(element, letter, value, f"friction {element.name}")
            self.by_sign[number - 1] |= element.values["forward"] != element.values["backward"]
            self.by_sign[number - 1] |= element.values["forward_at_rest"] != element.values["backward_at_rest"]
        self.rest_may_lack = not all(
            self._never_negative(sp.expand(self.constants[letter] * self.constants[inertia]))
            for pair, inertia in zip(EXCESSES, (Q.m_eff, Q.m_s), strict=True)
            for letter in pair
        )

    def _put_stops(self) -> None:
        seen = set[int]()
        for stop in self._of("stop"):
            if (number := self._one(stop)) in seen:
                raise _refused(stop, f"{stop} of {stop.on}: a coordinate has one `stop`, with both ends")
            seen.add(number)
            for letter, key in ((Q.x1_min, "low"), (Q.x1_max, "high")):
                if (value := stop.values[key]) is not None:
                    self._put(stop, letter, value, f"stop {stop.name}")
        if self.constants[Q.gamma2] == 0:  # no input, or it acts on what is held
            return
        if self.input is not None and self.input.limit is not None:
            self._refuse_sign(self.input, self.input.limit, f"the limit of {self.input.symbol}", positive=False)
            self._put(self.input, Q.u_max, self.input.limit, f"limit of {self.input.symbol}")
        elif self.input is not None and self.contact is not None:
            raise _refused(
                self.input,
                f"the current {self.input.symbol} has no limit, which a controller of hops needs: current(..., limit=)",
            )

    def _put_contact(self) -> None:
        if self.contact is None:
            for other in self.draft.elements:
                if other.where != "both":
                    raise _refused(
                        other, f"{other} acts in {other.where!r}, and the model has no contact that begins or ends"
                    )
            return
        loss = self.contact.values["impact_loss"]
        assert loss is not None
        if not (loss.is_Symbol and self.parameters[loss].domain == "fraction") and not (
            loss.is_number and 0 <= loss < 1
        ):
            raise _refused(
                self.contact, f"{self.contact}: impact_loss must be a number >= 0 and < 1, or a parameter in 'fraction'"
            )
        self._put(self.contact, Q.impact_loss, loss, "contact")
        for mass, index, others in ((self.first, 1, ("x2", "v2")), (self.second, 2, ("x1", "v1"))):
            if mass is not None and {mass.symbol.name, mass.velocity} & {*others}:
                raise _refused(
                    self.contact,
                    f"{self.contact}: {mass.symbol} with the velocity {mass.velocity} is mass {index} of the leg, and "
                    f"{', '.join(others)} are the other one in a stance: give it another name",
                )
        for element, force in self.of_further:
            _refuse_what_flight_cannot_carry(element, force)

    def _law(self) -> Law | None:
        """The law, whose gains take the letters that are theirs."""
        law = next((element for element in self.draft.elements if element.kind == "law"), None)
        if law is None:
            return None
        assert self.input is not None
        if self.contact is not None:
            raise _refused(law, f"{law}: a law is carried without a contact: a flight has the gains of its own law")
        if self.second is not None:
            moving = f"{self.first and self.first.symbol} and {self.second.symbol}"
            raise _refused(law, f"{law}: a law is carried on one mass, and {moving} move")
        assert self.first is not None
        if law.on != self.first.symbol:
            raise _refused(law, f"{law} acts on {law.on}, which is held")
        per_unit = -self.constants[Q.gamma2]
        if per_unit == 0:
            effort = "torque" if self.first.unit == "rad" else "force"
            raise _refused(
                law,
                f"{law} sets {self.input.symbol}, by which no force acts along {law.on}: declare it, "
                f"{effort}({law.on}, k_t*{self.input.symbol}), because the law divides by k_t",
            )
        along = 1 if self._is_positive(per_unit) else -1
        if not self._is_positive(along * per_unit):
            raise _refused(
                law,
                f"{law}: the force per {self.input.symbol} is {_short(per_unit)}, which may be 0 or of either sign for "
                "some robot, and the law divides by it: declare its parameters as 'positive'",
            )
        for letter, key in ((Q.K_p, "proportional"), (Q.K_d, "derivative")):
            value = law.values[key]
            assert value is not None
            self._refuse_sign(law, value, f"{law}: {key}", positive=False)
            self._put(law, letter, value, f"law {law.name}")
        return Law(_input_of(self.input), along)

    def _further(self, element: Element, force_1: sp.Expr, force_2: sp.Expr) -> None:
        what = str(element)
        force = Force(
            element.name, _exact(element, sp.sympify(force_1), what), _exact(element, sp.sympify(force_2), what), what,
            element.where,
        )  # fmt: skip
        field = field_name(force.name)
        if any(field_name(other.name) == field for other in self.further) or field in _TAKEN:
            raise _refused(
                element,
                f"{element}: another entry of the ledger has its name, {field}, already: give the element another",
            )
        self.further.append(force)
        self.of_further.append((element, force))

    # ---- signs ----

    def _is_positive(self, value: sp.Expr | None) -> bool:
        return (
            value is not None
            and self._never_negative(value)
            and any(self._product_is_positive(term) for term in sp.Add.make_args(sp.expand(value)))
        )

    def _product_is_positive(self, term: sp.Expr) -> bool:
        return all(
            factor.is_positive or self._in(factor.as_base_exp()[0], "positive") for factor in sp.Mul.make_args(term)
        )

    def _in(self, symbol: sp.Expr, *domains: str) -> bool:
        return symbol in self.parameters and self.parameters[symbol].domain in domains

    def _never_negative(self, value: sp.Expr) -> bool:
        return all(
            factor.is_nonnegative
            or self._in(factor.as_base_exp()[0], *_NOT_NEGATIVE)
            or factor.as_base_exp()[1].is_even
            for term in sp.Add.make_args(sp.expand(value))
            for factor in sp.Mul.make_args(term)
        )

    def _refuse_sign(self, declared: _Declared, value: sp.Expr | None, what: str, *, positive: bool) -> None:
        assert value is not None
        if self._is_positive(value) if positive else self._never_negative(value):
            return
        if not value.free_symbols:
            raise _refused(declared, f"{what} is {_short(value)}: it must be {'> 0' if positive else '>= 0'}")
        domain, of_that_sign = ("positive", ("positive",)) if positive else ("nonnegative", _NOT_NEGATIVE)
        names = sorted(
            (each for each in value.free_symbols if each in self.parameters and not self._in(each, *of_that_sign)),
            key=str,
        )
        tried = _Mechanism(self.draft)
        tried.parameters = self.parameters | {each: replace(self.parameters[each], domain=domain) for each in names}
        enough = tried._is_positive(value) if positive else tried._never_negative(value)
        them = ", ".join(map(str, names)) if enough else "it as a parameter of its own,"
        sign = "0 or negative" if positive else "negative"
        raise _refused(
            declared, f"{what} is {_short(value)}, which may be {sign} for some robot: declare {them} as {domain!r}"
        )

    # ---- what is left over ----

    def _parameters(self) -> tuple[Parameter, ...]:
        """The parameters that the motion reads; what has those of a coordinate that is held leaves them out."""
        read = {s for value in self.constants.values() for s in value.free_symbols}
        read |= {s for f in self.further for value in (f.force_1, f.force_2) for s in value.free_symbols}
        read |= {s for weight in self.weights for s in weight.free_symbols}
        named = {s for *_, value in self._expressions() for s in value.free_symbols}
        for symbol, parameter in self.parameters.items():
            if symbol not in named:
                raise ModelError(
                    f"the parameter {parameter.name} is declared, and no element has it",
                    self.draft.lines.get(parameter.name),
                )
        return tuple(each for symbol, each in self.parameters.items() if symbol in read)

    def _refuse_hidden(self, parameters: tuple[Parameter, ...]) -> None:
        """Names that the state of a model has, and no parameter may have."""
        names = {"y", "u"} if self.second is not None and self.first is not None else {"u"}
        for parameter in parameters:
            if parameter.name in names:
                raise ModelError(
                    f"the name of the parameter {parameter.name} is that of the compression or of the current in a state: "
                    "give it another",
                    self.draft.lines.get(parameter.name),
                )

    def _input(self, law: Law | None) -> Input | None:
        """The input: a current, or the target of the law that sets it."""
        if law is not None:
            (declared,) = self.draft.laws
            assert self.first is not None
            meaning = declared.meaning or f"target of the {self.first.thing}, to which the {law.current.thing} pulls it"
            return Input(declared.target, self.first.unit, law.current.thing, meaning, glyph_of(declared.target))
        current = self.input
        if current is not None and not any(
            current.symbol in value.free_symbols
            for element in self.draft.elements
            for value in element.values.values()
            if value is not None
        ):
            raise _refused(current, f"the current {current.symbol} is declared, and no force has it")
        if current is None or self.constants[Q.gamma2] == 0:
            return None
        return _input_of(current)

    def _listed(self, parameters: tuple[Parameter, ...]) -> Iterator[Listed]:
        """The elements with the parameters that each reads, the coordinates among them."""
        symbols = {each.symbol for each in parameters}
        for coordinate in self.draft.coordinates:
            if not coordinate.held:
                yield Listed("mass", coordinate.thing, _names(coordinate.inertia.free_symbols & symbols))
        if self.input is not None and self.input.limit is not None:
            yield Listed("motor", self.input.thing, _names(self.input.limit.free_symbols & symbols))
        for element in self.draft.elements:
            values = [element.on, *(value for value in element.values.values() if value is not None)]
            read = {symbol for value in values for symbol in value.free_symbols} & symbols
            yield Listed(element.kind, element.name, _names(read))


_TAKEN = {entry.name.rpartition("_")[0] for entry in (*Q.LEDGER.quantities, Q.STOP_LOSS)}
"""What names of entries of the ledger begin with."""


def _names(symbols: Iterable[sp.Symbol]) -> frozenset[str]:
    return frozenset(map(str, symbols))


def _named(axis: DeclaredCoordinate | None) -> Named | None:
    if axis is None:
        return None
    return Named(axis.symbol.name, axis.velocity, axis.unit, axis.thing, axis.directions, axis.meaning, axis.glyph)


def _input_of(current: DeclaredCurrent) -> Input:
    return Input(current.symbol.name, current.unit, current.thing, current.meaning, current.glyph)


def field_name(name: str) -> str:
    """An element's name as part of the name of a field."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def _short(value: object) -> str:
    line = " ".join(str(value).split())
    return line if len(line) <= 120 else f"{line[:117]}..."


def _cancelled(value: sp.Expr) -> sp.Expr:
    return sp.cancel(value) if value.free_symbols else value


def _dimension_of(
    declared: _Declared, value: sp.Expr, dimensions: dict[sp.Symbol, units.Dimension | None], what: str
) -> units.Dimension | None:
    try:
        return units.of_expression(value, dimensions)
    except units.UnitError as error:
        raise _refused(declared, f"{what} is {_short(value)}, whose units do not fit: {error}") from None


def _fits(
    declared: _Declared, value: sp.Expr, unit: str, dimensions: dict[sp.Symbol, units.Dimension | None], what: str
) -> None:
    actual, expected = _dimension_of(declared, value, dimensions, what), units.dimension(unit)
    if actual is not None and expected is not None and value.free_symbols and actual != expected:
        raise _refused(declared, f"{what} is {_short(value)} in {units.spelled(actual)}: it must be in {unit}")


# ---- numbers and functions ----


def _check_size(declared: _Declared, number: sp.Expr, what: str) -> None:
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise _refused(declared, f"{what}: a number must be 0 or between 1e-30 and 1e30 in size")


def _exact(declared: _Declared, value: sp.Expr, what: str) -> sp.Expr:
    """The expression with each float as the decimal fraction that it is written as: 12.5 is 25/2, 0.1 is 1/10."""
    exact = _spelled(declared, value, what)
    for number in exact.atoms(sp.Rational):
        _check_size(declared, number, what)
    return exact


def _spelled(declared: _Declared, value: sp.Expr, what: str) -> sp.Expr:
    if value.is_Float:
        _check_size(declared, value, what)
        fraction = Fraction(repr(float(value)))
        return sp.Rational(fraction.numerator, fraction.denominator)
    if value.is_Rational or value.is_Symbol:
        return value
    if value.is_Add or value.is_Mul:
        return value.func(*(_spelled(declared, part, what) for part in value.args))
    if value.is_Pow:
        base, exponent = (_spelled(declared, part, what) for part in value.args)
        if exponent.is_Integer:
            return sp.Pow(base, exponent)
    raise _refused(
        declared,
        f"{what}: {_short(value)} has no spelling in generated code: the closed form takes what is linear in coordinates, "
        "velocities and the current, with constants that are sums, products, quotients and whole powers of parameters "
        f"and numbers{_way_out(value)}",
    )


def _way_out(value: sp.Expr) -> str:
    """What to write in place of an expression without a spelling."""
    if any(isinstance(symbol, Coordinate | Current) for symbol in value.free_symbols):
        return ""
    if value.free_symbols:
        return f": declare {_short(value)} as a parameter of its own, whose value the robot gives"
    return ": write the number" if value.is_finite and value.is_real else ""


# ---- flight ----


def _refuse_what_flight_cannot_carry(element: Element, force: Force) -> None:
    """ModelError for a force on the body that acts in flight by more than a constant."""
    _, force_2 = (sp.cancel(each) for each in force.force_in("flight"))
    if force_2.free_symbols & {Q.x1, Q.x2, Q.v1, Q.v2}:
        raise _refused(
            element,
            f"{element} on the body would act in flight, too, and depends on its velocity: there a force may be "
            'constant alone; one that ends at take-off is declared with where="stance"',
        )


__all__ = ["DOMAINS", "Own", "field_name", "model_of"]
