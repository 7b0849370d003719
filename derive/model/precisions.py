"""The precisions of the C library, and the numbers that depend on the precision alone."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Precision:
    """A format of IEEE 754: the suffix of its names, its type in C, its size, the bits of its fraction."""

    name: str
    type: str
    bits: int
    fraction_bits: int

    @property
    def epsilon(self) -> float:
        """Distance from 1 to the next number."""
        return float(2.0**-self.fraction_bits)

    @property
    def exponent_bias(self) -> int:
        return 2 ** (self.bits - self.fraction_bits - 2) - 1

    @property
    def is_another(self) -> str:
        """The condition, by <float.h>, that the compiler's type has another format."""
        limits = {"float": "FLT", "double": "DBL"}[self.type]
        return f"{limits}_MANT_DIG != {self.fraction_bits + 1} || {limits}_MAX_EXP != {self.exponent_bias + 1}"


F32 = Precision("f32", "float", 32, 23)
F64 = Precision("f64", "double", 64, 52)
PRECISIONS = (F32, F64)


@dataclass(frozen=True)
class Constant:
    """A number with a name of its own in the generated code, of each precision; a whole number is an int."""

    name: str
    f32: float
    f64: float
    meaning: str

    def of(self, precision: Precision) -> float:
        value: float = getattr(self, precision.name)
        return value


def _each(name: str, value: Callable[[Precision], float], meaning: str) -> Constant:
    return Constant(name, value(F32), value(F64), meaning)


def _leading(value: Fraction, bits: int) -> float:
    """The number cut off behind its first bits, which a float holds with room for a factor."""
    scale = Fraction(2) ** (bits - math.frexp(float(value))[1])
    return float(Fraction(math.floor(value * scale)) / scale)


# Digits of ln 2 and of pi/2, for reductions in two and three parts.
_LOG_2 = Fraction("0.693147180559945309417232121458176568075500134360255254120680009")
_QUARTER_TURN = Fraction("1.57079632679489661923132169163975144209858469968755291048747230")


def _room(precision: Precision) -> int:
    """Bits of a leading part."""
    return {32: 12, 64: 32}[precision.bits]


def _behind(value: Fraction, precision: Precision) -> Fraction:
    return value - Fraction(_leading(value, _room(precision)))


TERMS = Constant("TERMS", 24, 40, "terms of the power series of W")
SHORT = Constant("SHORT", 1e-3, 1e-5, "the square of a step, in rates, that a short series carries")
FAR = Constant("FAR", 1e3, 1e4, "a^2/q above which a state late in a phase is counted from where the phase ends")
"""By W alone a velocity that has faded has an error of a^2/q eps. Chosen; docs/developers/decisions.md."""

LIMITS = (
    _each("EPS", lambda p: p.epsilon, "distance from 1 to the next number"),
    _each("ROOT_EPS", lambda p: p.epsilon**0.5, "its square root"),
    Constant("NEVER", 1e38, 1e300, "what is beyond is refused; the time of what does not happen"),
    Constant("UNDERFLOW", 1e-30, 1e-280, "below this, squares and quotients lose digits"),
    Constant("FASTEST_CONTACT", 1e-10, 1e-90, "a contact whose damper relaxes in less time [s] does so at once"),
    Constant("REACHED_WITHIN", 1e-6, 1e-14, "[m] the search for a current ends this near"),
    Constant("NEAR_WITHIN", 4e-6, 2e-10, "[m] an apex this near is reached"),
    Constant(
        "STIFFEST", 1e3, 1e7, "a real pole this many times the frequency of mass 2 on the spring: ill-conditioned"
    ),
    TERMS,
    FAR,
    Constant("SMALLEST_EXPONENT", -87.0, -708.0, "exp of less counts as 0"),
    Constant("PREDICTION", 0.1, 0.1, "a shorter step, of the share, predicts a root well enough"),
)
"""Limits that the library has."""

CONSTANTS = (
    *LIMITS,
    _each("LOG_2_HIGH", lambda p: _leading(_LOG_2, _room(p)), "leading bits of ln 2"),
    _each("LOG_2_LOW", lambda p: float(_behind(_LOG_2, p)), "ln 2 less those"),
    _each("QUARTER_TURN_HIGH", lambda p: _leading(_QUARTER_TURN, _room(p)), "leading bits of pi/2"),
    _each("QUARTER_TURN_MIDDLE", lambda p: _leading(_behind(_QUARTER_TURN, p), _room(p)), "the bits behind those"),
    _each(
        "QUARTER_TURN_LOW", lambda p: float(_QUARTER_TURN - Fraction(_leading(_QUARTER_TURN, 2 * _room(p)))), "the rest"
    ),
    Constant("LARGEST_ANGLE", 1e6, 1e15, "a larger angle has no digit left"),
    _each("ROUNDER", lambda p: 1.5 * 2.0**p.fraction_bits, "added to a number, it leaves it rounded in its last bits"),
    _each("FRACTION_BITS", lambda p: p.fraction_bits, "bits of the fraction"),
    Constant("LOWER_HALF", 12, 27, "bits that are cut off so that a square is exact"),
    _each("SMALLEST_NORMAL", lambda p: 2.0 ** (1 - p.exponent_bias), "smallest normal number"),
    Constant("TINY_UP", 2.0**24, 2.0**54, "scales a subnormal number up to a normal one"),
    Constant("TINY_DOWN", 2.0**-8, 2.0**-18, "scales its cube root back"),
    _each("EXPONENT_BIAS", lambda p: p.exponent_bias, "of the exponent's bits"),
    SHORT,
)
"""Those of the C library, the limits among them."""
