"""Names that a model file may give, and how C spells them.

An author may use any identifier of Python. What another language cannot have is spelled otherwise there, by one rule:
C's keywords and macros get an underscore, and a letter that C's names do not have becomes its number.
"""

import keyword
import re
import unicodedata

from sympy.printing import c as in_sympys_c
from sympy.printing import cxx as in_sympys_cpp

FURTHER_WORDS = {
    "catch", "co_await", "co_return", "co_yield", "complex", "concept", "consteval", "constinit", "errno", "far",
    "final", "i386", "imaginary", "interface", "linux", "module", "near", "offsetof", "override", "real", "requires",
    "typeof", "typeof_unqual", "unix",
}  # fmt: skip
"""Keywords of later standards, macros in small letters that compilers and common headers define, and the type that the
library's C is written in.
"""

KEYWORDS_OF_C = FURTHER_WORDS.union(
    in_sympys_c.reserved_words, in_sympys_c.reserved_words_c99, *in_sympys_cpp.reserved.values()
) - {"entry"}
"""Of C and C++, those that sympy knows among them; no standard has `entry`."""

MACROS_WITH_SMALL_LETTERS = frozenset({
    # assert.h, math.h, stdio.h, threads.h, netdb.h, signal.h, sys/stat.h; windows.h and rpcndr.h
    "static_assert", "math_errhandling", "stdin", "stdout", "stderr", "L_ctermid", "L_cuserid", "L_tmpnam", "P_tmpdir",
    "thread_local", "noreturn", "h_addr", "h_errno", "sa_handler", "sa_sigaction", "st_atime", "st_ctime", "st_mtime",
    "cdecl", "hyper", "pascal", "small",
    # CMSIS and Arduino.h
    "CoreDebug", "SysTick", "Serial",
    # processors and systems that compilers name
    "avr", "hpux", "m68k", "mips", "ns16000", "pic32mx", "pyr", "sgi", "sparc", "sun", "vax",
})  # fmt: skip
"""Macros that stand for something without arguments; one with arguments is none where no bracket follows."""
ROWS_OF_MACROS = re.compile(
    r"[EI]|[ABDP][0-9]+|(PRI|SCN)[a-z]\w*|[AP]F_\w+|s6_addr\w*|(si|sigev)_\w+|Serial([0-9]+|USB)"
)
"""complex.h has I; Arduino's boards have A0, D0; binary.h and termios.h B1, B110; headers of processors E and P0;
inttypes.h, sys/socket.h, netinet/in.h, signal.h and Arduino.h the others.
"""


def in_c(name: str) -> str:
    """A name as C spells it: itself, where that is no keyword, macro or name of the library.

    Names in capitals count as macros: headers of processors have thousands. Different names are spelled differently: an
    underscore stands behind each member of a row such as I, I_, I__, and U with six digits for a letter is decoded as
    that.

    >>> [in_c(name) for name in ("k", "A0", "J_L", "I_", "int", "θ")]
    ['k', 'A0_', 'J_L_', 'I__', 'int_', 'U0003B8']
    """
    spelled = re.sub("[^A-Za-z0-9_]|U(?=[0-9A-F]{6})|[hH](?=(?i:opform))", lambda match: f"U{ord(match[0]):06X}", name)
    return f"{spelled}_" if _is_of_c(spelled.rstrip("_")) else spelled


def _is_of_c(name: str) -> bool:
    """Whether C, its headers or the library have a name, or may have it."""
    return (
        name in KEYWORDS_OF_C
        or name in MACROS_WITH_SMALL_LETTERS
        or ROWS_OF_MACROS.fullmatch(name) is not None
        or (name.isupper() and not re.fullmatch("[A-Z]_?[0-9]*", name))
        or name.endswith(("_real", "_f32", "_f64"))
    )


KEYS_OF_ROBOTS = ("name", "model", "description", "fit", "parameters")
"""Keys of a robot's file and fields of its JSON: a parameter of such a name stands in the table `parameters`."""

OF_ROBOTS = frozenset({
    "CHECKS", "all_fields", "compression_at_rest", "description", "fall", "fields", "fit", "home", "label", "letters",
    "name", "parameters", "sample", "solver", "standing_height", "to_toml", "with_parameters",
})  # fmt: skip
"""Attributes of a robot's class in Python."""


def in_python(name: str) -> str:
    """The attribute of a robot that is a parameter: `name_` where a robot has the attribute `name`.

    >>> in_python("k"), in_python("letters")
    ('k', 'letters_')
    """
    return f"{name}_" if name in OF_ROBOTS else name


OF_RESULTS = re.compile(
    "t|N|E|H|AED|time|total_energy|status|duration|input|contact|event_time|event_kind|(friction|stop)_.*"
)
"""Columns that results have beside coordinates, velocities and the input."""


def why_no_column(name: str) -> str | None:
    """Why a name cannot be that of a coordinate, a velocity or the input; None if it can."""
    return f"a column of results has this name: {name}" if OF_RESULTS.fullmatch(name) else None


def why_not(name: object) -> str | None:
    """Why a name can be none of a model; None if it can."""
    if not isinstance(name, str) or not name.isidentifier() or name.startswith("_"):
        return "it must be a str that is an identifier of Python, and begin with a letter"
    if unicodedata.normalize("NFKC", name) != name:
        return f"Python reads it as {unicodedata.normalize('NFKC', name)!r}: write it so"
    if keyword.iskeyword(name):
        return "it must not be a keyword of Python"
    if name.removesuffix("_") in OF_ROBOTS and name.endswith("_"):
        return f"it is the attribute of a robot with a parameter {name[:-1]!r}"
    return "it is the travel of the spring, which every robot has" if name == "travel" else None
