"""Macros of the generated C."""

import re
from pathlib import Path

GENERATED = Path(__file__).resolve().parents[1] / "generated" / "c"


def arguments_of_macros() -> set[str]:
    """The names of all arguments of macros in the generated library."""
    heads = (found for path in GENERATED.rglob("*.[ch]")
             for found in re.findall(r"#define \w+\(([^)]*)\)", path.read_text("utf-8")))  # fmt: skip
    return {name.strip() for head in heads for name in head.split(",")} - {"", "..."}
