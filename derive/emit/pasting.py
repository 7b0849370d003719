"""The kernels that a pasted formula calls: their text in C or NumPy, each behind those that it calls itself.

`pasted.c` and `pasted.py` hold them as source. In C the word `real` becomes the type of a precision, and a name in _real
gets the prefix of a model; libm's functions get theirs.
"""

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

from ..maths.kernels import tables
from ..model.precisions import F32, F64, Precision
from .instantiate import instantiate

_HERE = Path(__file__).parent
_LIBM = ("cbrt", "cos", "exp", "expm1", "fabs", "fmax", "fmin", "sin", "sqrt")


def in_numpy(kernels: Iterable[str]) -> list[str]:
    """The functions of some kernels, and those that they call, in the order of the source."""
    functions = _python()
    return [functions[name] for name in _closure({f"_{kernel}" for kernel in kernels}, functions)]


@cache
def _python() -> dict[str, str]:
    text = (_HERE / "pasted.py").read_text("utf-8")
    functions = [each for each in ast.parse(text).body if isinstance(each, ast.FunctionDef)]
    return {each.name: ast.get_source_segment(text, each) or "" for each in functions}


def in_c(kernels: Iterable[str], prefix: str, precision: Precision) -> list[str]:
    """The types and functions of some kernels, and those that they call, in the order of the source; each is skipped by
    a compiler that has had it already.
    """
    parts = _c()
    wanted = _closure({f"{kernel}_real" for kernel in kernels}, parts)
    return [_guarded(_spelled(parts[name], prefix, precision), _spelled(name, prefix, precision)) for name in wanted]


def _guarded(code: str, name: str) -> str:
    macro = f"{name.upper()}_IS_DEFINED"
    return f"#ifndef {macro}\n#define {macro}\n{code}\n#endif"


@cache
def _c() -> dict[str, str]:
    """The parts of the source by the name that each defines."""
    _, *parts = (_HERE / "pasted.c").read_text("utf-8").rstrip().split("\n\n")
    defines = re.compile(r"^} (\w+_real);|^static inline \w+ (\w+_real)\(", re.MULTILINE)
    named = ((match[1] or match[2], part) for part in parts if (match := defines.search(part)))
    return dict(named)


def _spelled(text: str, prefix: str, precision: Precision) -> str:
    numbers = {table.name: ", ".join(map(repr, table.values)) for table in tables(F64)}
    for name in ("GAUSS_PLACES", "GAUSS_WEIGHTS"):
        text = text.replace(f"{name}_real", numbers[name])
    text = text.replace("EPSILON_real", repr(precision.epsilon))

    def named(match: re.Match[str]) -> str:
        name = match[1]
        libm = f"{name}f" if precision == F32 else name
        return libm if name in _LIBM else f"{prefix}_{name}"

    return re.sub(rf"(\w+)_{precision.name}\b", named, instantiate(text, precision))


def _closure(wanted: set[str], parts: Mapping[str, str]) -> Iterator[str]:
    """The parts that are wanted and those that they name, in the order of all."""
    names, found = set(parts), set[str]()
    while wanted:
        found |= wanted
        wanted = {word for name in wanted for word in re.findall(r"\w+", parts[name]) if word in names} - found
    return (name for name in parts if name in found)
