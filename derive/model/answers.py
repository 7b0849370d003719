"""What the command line answers as JSON and CSV, from which its schema and the page about it are made."""

import math
import re
import textwrap
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..ir import DOMAINS, Quantity, Record
from . import words
from .equations import Model
from .kinds import Kind
from .names import KEYS_OF_ROBOTS
from .quantities import TRAVEL

SIMPLE = {"number", "integer", "string", "boolean", "null"}


@dataclass(frozen=True)
class Field:
    """A field or a column. The type of a column is its unit, of a field one of SIMPLE, the name of an object, a list of
    either, or one of several. A text may be one of some words alone.
    """

    name: str
    type: str
    meaning: str = ""
    words: tuple[str, ...] = ()

    @property
    def cell(self) -> str:
        """The meaning as a table says it, the words listed."""
        *first, last = (f"`{word}`" for word in self.words or ("",))
        listed = f"{', '.join(first)} or {last}" if first else last.strip("`")
        return "; ".join(part for part in (listed, self.meaning) if part)


@dataclass(frozen=True)
class Answer:
    """An object, or the columns of a table, with what is to be said of all its fields."""

    name: str
    note: str
    columns: bool
    fields: tuple[Field, ...]

    @property
    def notes(self) -> list[str]:
        """The note as a paragraph, if there is one."""
        return [textwrap.fill(self.note, 120)] if self.note else []

    @property
    def lines(self) -> list[str]:
        """Its fields as lines of a dictionary: the type of each; of a column unit and meaning."""
        texts = (
            f"{each.type}: {each.meaning}".removesuffix(": ") if self.columns else each.type for each in self.fields
        )
        return [f'"{each.name}": "{text}",' for each, text in zip(self.fields, texts, strict=True)]

    @property
    def heads(self) -> tuple[str, str, str]:
        return ("column", "unit", "meaning") if self.columns else ("field", "type", "meaning")

    @property
    def title(self) -> str:
        """Its heading; what a command prints is named by the command."""
        return f"`{self.name} --json`" if self.name.startswith("hopform ") else self.name


OF_CONTACT = (
    "hopform stance", "hopform hop", "hopform control", "hopform reach", "hopform equations", "CSV of a stance", "CSV of a run",
    "Table of a run",
)  # fmt: skip
"""What commands answer that need a contact."""
OF_INPUT = {kind: ("u",) for kind in ("hopform stance", "hopform motion", "part", "phase", "derivatives")}
"""Fields of the input, which answers of a model without one have not."""
OF_FIRST: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("state", "CSV of a stance", "sensitivities", "derivatives"), ("x1", "v1")),
    "phase": ("mode_1",),
}
"""Those of the actuator of a leg."""

Tables = dict[str, dict[str, str]]


def answers(
    model: Model, ledger: Record, verdicts: Mapping[str, tuple[str, ...]], kinds: Iterable[Kind]
) -> tuple[Answer, ...]:
    """Everything that is answered about a model with this ledger, in its words; verdicts: words by their table."""
    absent = [
        (kind, name)
        for has, fields in ((model.input is not None, OF_INPUT), (1 in model.moving, OF_FIRST))
        for kind, names in fields.items()
        for name in names
        if not has
    ]
    enumerated = {kind.table: tuple(word.text for word in kind.words) for kind in kinds}
    enumerated |= {"DOMAINS": tuple(DOMAINS), **verdicts}
    limits = [TRAVEL] if model.has_contact else []
    apart = tuple(each for each in model.parameters if each.name in KEYS_OF_ROBOTS)
    of_facts = {
        "ledger": tuple(Field(entry.name, "number", entry.meaning) for entry in ledger.quantities),
        "robot": (
            *(_parameter(each) for each in (*model.parameters, *limits) if each not in apart),
            *([Field("parameters", "parameters", "whose names stand above for something else")] if apart else []),
        ),
        "parameters": tuple(map(_parameter, apart)),
        "derivatives": tuple(
            Field(each.name, "number or null", f"per {'unit' if each.unit == '1' else each.unit}")
            for each in model.parameters
        ),
    }
    tables: Tables = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
    tables |= {"parameters": {}} if apart else {}
    return tuple(
        Answer(
            name,
            words.text(model, table.pop("note", "").replace("\n", " ")),
            name[0].isupper(),
            (
                *([Field("hopform", "string", "version")] if name.startswith("hopform ") else ()),
                *(
                    _field(model, key, text, enumerated)
                    for keys, text in table.items()
                    for key in keys.split(", ")
                    if (name, key) not in absent
                ),
                *of_facts.get(name, ()),
            ),
        )
        for name, table in (tables if model.has_contact else _without_contact(tables)).items()
    )


def _without_contact(tables: Tables) -> Tables:
    """What commands answer of a model without a contact, and the objects in it."""
    kept = [name for name in tables if name not in OF_CONTACT and (name[0].isupper() or name.startswith("hopform "))]
    kept += [name for name in ("parameters",) if name in tables]  # of robots, whose fields are those of the model
    for name in kept:  # which grows
        types = " ".join(text.partition(": ")[0] for field, text in tables[name].items() if field != "note")
        kept += [each for each in tables if each not in kept and re.search(rf"\b{each}\b", types)]
    return {name: table for name, table in tables.items() if name in kept}


def _field(model: Model, name: str, text: str, enumerated: Mapping[str, tuple[str, ...]]) -> Field:
    kind, _, meaning = text.partition(": ")
    unit, comma, about = meaning.partition(", ")
    meaning = f"{model.unit(unit)}{comma}{words.text(model, about)}" if unit == "A" else words.text(model, meaning)
    if kind.startswith("word of "):
        return Field(name, "string", meaning, enumerated[kind.removeprefix("word of ")])
    return Field(name, kind, meaning)


def _parameter(parameter: Quantity) -> Field:
    domain, unit = parameter.interval, "" if parameter.unit == "1" else f"{parameter.unit}, "
    if -math.inf in domain or math.inf in domain:
        return Field(parameter.name, "number or null", f"{unit}{parameter.meaning}; null: none")
    return Field(parameter.name, "number", f"{unit}{parameter.meaning}")


def schema(answers: Iterable[Answer]) -> dict[str, Any]:
    """The answers as JSON Schema: `$defs` has each object by its name, that of a command by the command."""
    defined = {
        answer.name: {
            "type": "object",
            "properties": {field.name: _schema_of(field) for field in answer.fields},
            "required": [field.name for field in answer.fields],
            "additionalProperties": False,
        }
        for answer in answers
        if not answer.columns
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$defs": defined}


def _schema_of(field: Field) -> dict[str, Any]:
    enumeration = {"enum": list(field.words)} if field.words else {}
    return _type(field.type) | enumeration | ({"description": field.meaning} if field.meaning else {})


def _type(kind: str) -> dict[str, Any]:
    if " or " in kind:
        return {"anyOf": [_type(each) for each in kind.split(" or ")]}
    if kind.startswith("list of "):
        return {"type": "array", "items": _type(kind.removeprefix("list of "))}
    if kind.startswith("map of "):
        return {"type": "object", "additionalProperties": _type(kind.removeprefix("map of "))}
    return {"type": kind} if kind in SIMPLE else {"$ref": f"#/$defs/{kind}"}
