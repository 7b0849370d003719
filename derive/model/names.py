"""Names that a model file may give: they become members of structs, columns of tables, keys of files and of JSON."""

import builtins
import keyword
import re

from sympy.printing import c as in_c
from sympy.printing import cxx as in_cpp

FURTHER_WORDS = {
    "catch", "co_await", "co_return", "co_yield", "complex", "concept", "consteval", "constinit", "errno", "far",
    "final", "i386", "imaginary", "interface", "linux", "module", "near", "offsetof", "override", "requires", "typeof",
    "typeof_unqual", "unix",
}  # fmt: skip
"""Keywords of later standards, and macros in small letters that compilers and common headers define."""

KEYWORDS_OF_C = FURTHER_WORDS.union(in_c.reserved_words, in_c.reserved_words_c99, *in_cpp.reserved.values()) - {"entry"}
"""Of C and C++, those that sympy knows among them; no standard has `entry`."""

OF_ROBOTS = frozenset(
    [
        "all_fields",
        "CHECKS",
        "description",
        "dtype",
        "fall",
        "fields",
        "fit",
        "horizon",
        "letters",
        "max_phases",
        "model",
        "name",
        "parameters",
        "robot",
        "sample",
        "solver",
        "start",
        "t",
        "to_toml",
        "travel",
    ]
)
"""Names of a robot's class in Python, of keys of its file, and of arguments beside its state."""

ALLOWED = "letters, digits and _, a letter first"


OF_RESULTS = re.compile(
    "t|N|E|H|AED|time|total_energy|status|duration|input|contact|event_time|event_kind|(friction|stop)_.*"
)
"""Columns that results have beside coordinates, velocities and the input."""


def why_no_column(name: str) -> str | None:
    """Why a name cannot be that of a coordinate, a velocity or the input; None if it can."""
    return f"a column of results has this name: {name}" if OF_RESULTS.fullmatch(name) else None


def why_not(name: object) -> str | None:
    """Why a name cannot stand in generated code; None if it can."""
    if not isinstance(name, str) or not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        return f"it must be a str of {ALLOWED}"
    reasons = (
        (
            name.isupper() and not re.fullmatch("[A-Z]_?[0-9]*", name),
            "it must have a small letter, or be one letter with an index, because names in capitals are macros in C",
        ),
        (name in KEYWORDS_OF_C or keyword.iskeyword(name), "it must not be a keyword of Python, C or C++"),
        (
            hasattr(builtins, name) or hasattr(tuple, name) or name in OF_ROBOTS,
            "it must not be built into Python, or be an attribute of a robot",
        ),
        (
            name.endswith(("_real", "_f32", "_f64")) or name.startswith("d_") or "hopform" in name.lower(),
            "it must not end in _real, _f32 or _f64, begin with d_, or contain hopform, as names of generated code do",
        ),
    )
    return next((reason for holds, reason in reasons if holds), None)
