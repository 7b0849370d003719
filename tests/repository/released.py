"""What is stable of a release, as data: `python -m tests.repository.released` writes that of this checkout.

docs/reference/versions.md says what the data promise. A table may grow; a list, a number or a text stays as it is. So
what may be added stands in a table, by its name, and what may not stands in a list or a text.
"""

import inspect
import json
import re
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import hopform
import hopform.model as elements
from hopform_solver import VERSION
from hopform_solver.structs import STRUCTS

ROOT = Path(__file__).resolve().parents[2]
RECORD = Path(__file__).with_suffix(".json")
HEADERS = ROOT / "generated" / "c" / "include" / "hopform"
MODULES = ("extend", "hopping", "hopping.controllers", "hopping.terrain", "identify", "model", "reference")
OF_MODEL = ("Derivation", "Formula", "Mode", "ModelError", "Quantity", "derive", *elements.__all__)
"""What `hopform.model` has of the derivation for a model file and its reader."""
OURS = ("hopform", "hopform_solver", "derive")
"""Packages whose classes have public members; others are Python's or NumPy's."""
DECLARATION = re.compile(r"^(\w[^;{}#]*\b(\w+)\([^;{}]*\);)", re.MULTILINE)

Table = dict[str, Any]


def found() -> Table:
    """The promises of this checkout."""
    return {"version": VERSION, "python": of_python(), "c": of_c(), "json": of_json(), "solver.toml": of_facts()}


def of_python() -> Table:
    """By each public name what may be called or read of it."""
    names = {name: entry(getattr(hopform, name)) for name in hopform.__all__}
    for module in (import_module(f"hopform.{name}") for name in MODULES):
        names |= {f"{module.__name__[8:]}.{name}": entry(getattr(module, name)) for name in public_of(module)}
    return dict(sorted(names.items()))


def public_of(module: ModuleType) -> list[str]:
    if module.__name__ == "hopform.model":
        return sorted(OF_MODEL)
    own = [name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
    return sorted(name for name in getattr(module, "__all__", own) if not name.startswith("_"))


def entry(value: Any) -> Table:
    """Of a class its public members, of a function what it takes; of anything else that it is there."""
    if isinstance(value, type):
        bases = [base for base in value.__mro__ if base.__module__.split(".")[0] in OURS]
        names = {name for base in bases for name in (*vars(base), *vars(base).get("__annotations__", {}))}
        return {"members": {name: {} for name in sorted(names) if not name.startswith("_")}}
    if not inspect.isfunction(value):
        return {}
    several = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    taken = [each for each in inspect.signature(value).parameters.values() if each.kind not in several]
    needed = [each.name for each in taken if each.default is each.empty]
    placed = [each.name for each in taken if each.kind is not each.KEYWORD_ONLY]
    optional = {each.name: {} for each in taken if each.default is not each.empty}
    return {"placed": placed, "needed": needed, "optional": optional}


def of_c() -> Table:
    """Functions as they are declared, numbers of macros, and the members of each struct in their order."""
    texts = {path.name: without_comments(path.read_text("utf-8")) for path in sorted(HEADERS.glob("*.h"))}
    declared = {name: line for text in texts.values() for line, name in DECLARATION.findall(text)}
    numbers = dict(re.findall(r"^#define (HOPFORM_\w+) +(\(?-?\d+\)?)$", texts["hopform.h"], re.M))
    structs = {name: [f"{kind} {member}[{count}]" for member, kind, count in of] for name, of in STRUCTS.items()}
    functions = {name: " ".join(line.split()) for name, line in sorted(declared.items())}
    return {"functions": functions, "numbers": numbers, "structs": structs}


def without_comments(text: str) -> str:
    return re.sub(r"[ \t]*/\*.*?\*/", "", text, flags=re.DOTALL)


def of_json() -> Table:
    """Of each object of schema.json the type of each property, and which are always there."""
    objects = json.loads((ROOT / "generated" / "schema.json").read_text("utf-8"))["$defs"]
    return {name: object_of(said) for name, said in objects.items()}


def object_of(said: Table) -> Table:
    """An object, or another type, without its descriptions."""
    if "properties" not in said:
        return {"is": type_of(said)}
    properties = {name: type_of(each) for name, each in said["properties"].items()}
    return {"properties": properties, "always": {name: {} for name in said["required"]}}


def type_of(said: Table) -> str:
    return json.dumps({key: value for key, value in said.items() if key != "description"}, sort_keys=True)


def of_facts() -> Table:
    """The format of solver.toml, and its keys by table."""
    facts = tomllib.loads((ROOT / "generated" / "solver.toml").read_text("utf-8"))
    tables = {name: value for name, value in facts.items() if isinstance(value, (dict, list))}
    keys = {name: dict.fromkeys(keys_of(value), {}) for name, value in tables.items()}
    return {"format": facts["format"], "keys": {**dict.fromkeys(facts, {}), **keys}}


def keys_of(table: Any) -> list[str]:
    """Keys that a table has, or each table of a list."""
    several = [set(each) for each in table if isinstance(each, dict)] if isinstance(table, list) else [set(table)]
    return sorted(set.intersection(*several)) if several else []


def moved(before: Any, now: Any, path: str = "") -> Iterator[str]:
    """What is gone or another since a record, a line each."""
    if not isinstance(before, dict):
        if before != now:
            yield f"{path}: {before!r} in the record, {now!r} now"
        return
    for key, value in before.items():
        if not isinstance(now, dict) or key not in now:
            yield f"{path} {key} is gone".strip()
        else:
            yield from moved(value, now[key], f"{path} {key}".strip())


def needs_a_format(before: Table, now: Table) -> list[str]:
    """What moved in C since a record, a line each, where solver.toml still has the format of the record: a folder that
    was built before would pass for a new one.
    """
    if before["solver.toml"]["format"] != now["solver.toml"]["format"]:
        return []
    return [
        *moved(before["c"]["functions"], now["c"]["functions"]),
        *moved(before["c"]["structs"], now["c"]["structs"]),
    ]


if __name__ == "__main__":
    latest = found()
    if RECORD.is_file() and (lines := needs_a_format(json.loads(RECORD.read_text("utf-8")), latest)):
        raise SystemExit("\n".join([*lines, "FORMAT of derive/emit/facts.py must be another one"]))
    RECORD.write_text(json.dumps(latest, indent=1) + "\n", "utf-8")
