"""Units of SI as powers of its base units: whether what a file adds, or calls a force, fits."""

import re
from collections.abc import Mapping

import sympy as sp

Dimension = tuple[sp.Rational, ...]
"""Powers of m, kg, s, A, K."""

_BASE = ("m", "kg", "s", "A", "K")
_NONE: Dimension = (sp.S.Zero,) * len(_BASE)


def _of_base(**powers: int) -> Dimension:
    return tuple(sp.Integer(powers.get(name, 0)) for name in _BASE)


_UNITS = {
    **{name: _of_base(**{name: 1}) for name in _BASE},
    "1": _NONE, "": _NONE, "rad": _NONE,
    "g": _of_base(kg=1), "mm": _of_base(m=1), "cm": _of_base(m=1), "ms": _of_base(s=1), "mA": _of_base(A=1),
    "Hz": _of_base(s=-1), "N": _of_base(kg=1, m=1, s=-2), "Pa": _of_base(kg=1, m=-1, s=-2),
    "bar": _of_base(kg=1, m=-1, s=-2), "J": _of_base(kg=1, m=2, s=-2), "W": _of_base(kg=1, m=2, s=-3),
    "C": _of_base(A=1, s=1), "V": _of_base(kg=1, m=2, s=-3, A=-1), "ohm": _of_base(kg=1, m=2, s=-3, A=-2),
    "H": _of_base(kg=1, m=2, s=-2, A=-2), "Wb": _of_base(kg=1, m=2, s=-2, A=-1), "T": _of_base(kg=1, s=-2, A=-1),
}  # fmt: skip
SCALED = ("g", "mm", "cm", "ms", "mA", "bar")
"""Units that are no SI units: a formula would be off by a power of ten."""


class UnitError(ValueError):
    """Units that do not fit."""


def dimension(unit: str) -> Dimension | None:
    """The powers of the base units in a unit such as "kg m^2/s"; None for one that is not known."""
    above, *below = unit.replace("*", " ").split("/")
    total = list(_NONE)
    for sign, text in ((1, above), *((-1, each) for each in below)):
        for factor in text.replace("(", " ").replace(")", " ").split():
            match = re.fullmatch(r"([A-Za-z]+|1)(?:\^?(-?\d+))?", factor)
            if match is None or match[1] not in _UNITS:
                return None
            power = sign * int(match[2] or 1)
            total = [one + power * other for one, other in zip(total, _UNITS[match[1]], strict=True)]
    return tuple(total)


def base_units(unit: str) -> dict[str, int]:
    """The powers of the base units in a unit, and that of rad, those that are not 0; none for one that is not known.

    >>> base_units("N m s/rad")
    {'kg': 1, 'm': 2, 's': -1, 'rad': -1}
    """
    powers, with_length = dimension(unit), dimension(unit.replace("rad", "m"))
    if powers is None or with_length is None:
        return {}
    by_name = dict(zip(_BASE, powers, strict=True)) | {"rad": with_length[0] - powers[0]}
    return {name: int(by_name[name]) for name in ("kg", "m", "s", "A", "K", "rad") if by_name[name]}


def scaled(unit: str) -> str:
    """The first factor of a unit that is a multiple of an SI unit; "" if there is none."""
    return next((each for each in re.findall(r"[A-Za-z]+", unit) if each in SCALED), "")


def of_expression(value: sp.Expr, dimensions: Mapping[sp.Symbol, Dimension | None]) -> Dimension | None:
    """The powers of the base units in an expression; None where a unit is not known, as that of a number which may have
    one, and of 0.

    Raises UnitError for a sum of what has different units.
    """
    if value.is_number:
        return _NONE if value in (1, -1) else None
    if value.is_Symbol:
        return dimensions.get(value)
    if isinstance(value, sp.Abs):
        return of_expression(value.args[0], dimensions)
    if value.is_Pow:
        base = of_expression(value.base, dimensions)
        return None if base is None or not value.exp.is_Rational else tuple(each * value.exp for each in base)
    parts = [(part, of_expression(part, dimensions)) for part in value.args]
    if value.is_Mul:
        if any(each is None for _, each in parts):
            return None
        return tuple(map(sum, zip(*(each for _, each in parts if each is not None), strict=True)))
    terms = [(part, each) for part, each in parts if each is not None and not part.is_number]
    for part, dimension_of_part in terms[1:]:
        if dimension_of_part != terms[0][1]:
            raise UnitError(f"{terms[0][0]} is in {spelled(terms[0][1])} and {part} in {spelled(dimension_of_part)}")
    return terms[0][1] if terms else None


def spelled(powers: Dimension) -> str:
    """The base units of a dimension."""
    for name in ("N", "J", "W", "V"):
        if powers == _UNITS[name]:
            return {"J": "N m"}.get(name, name)
    above = [
        _power(name, power)
        for name, power in zip(("kg", *_BASE[:1], *_BASE[2:]), _in_order(powers), strict=True)
        if power > 0
    ]
    below = [
        _power(name, -power)
        for name, power in zip(("kg", *_BASE[:1], *_BASE[2:]), _in_order(powers), strict=True)
        if power < 0
    ]
    return (" ".join(above) or "1") + (f"/{'/'.join(below)}" if below else "")


def _in_order(powers: Dimension) -> Dimension:
    meter, kilogram, *others = powers
    return (kilogram, meter, *others)


def _power(name: str, power: sp.Expr) -> str:
    return name if power == 1 else f"{name}^{power}"
