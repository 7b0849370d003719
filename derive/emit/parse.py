"""C of the engine, as it is rendered in one precision, read from memory into a syntax tree with its comments.

Constants of the precision and of the public header keep their names; all other macros are expanded. Of formulas_*.h the
declarations alone are read: what they compute is printed from the derivation.
"""

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pcpp import Action, OutputDirective, Preprocessor
from pycparser import c_ast, c_parser

SYSTEM = {
    "stddef.h": "typedef unsigned long size_t;\ntypedef long ptrdiff_t;\n",
    "stdbool.h": "#define bool _Bool\n",
    "float.h": "#define FLT_MANT_DIG 24\n#define FLT_MAX_EXP 128\n#define DBL_MANT_DIG 53\n#define DBL_MAX_EXP 1024\n",
    "stdint.h": "typedef signed char int8_t; typedef unsigned char uint8_t; typedef short int16_t;\n"
    "typedef unsigned short uint16_t; typedef int int32_t; typedef unsigned int uint32_t; typedef long int64_t;\n"
    "typedef unsigned long uint64_t; typedef unsigned long uintptr_t;\n",
    "string.h": "",
    "math.h": "",
}
"""What the engine needs of the headers of C."""

_CONSTANT = re.compile(r"#define (HOPFORM_\w+) (\(?-?[\d.][\w.+-]*\)?)(?: +/\*[*<]* (.*?) \*/)?$", re.MULTILINE)
_COMMENT = re.compile(r"/\*(?P<text>.*?)\*/", re.DOTALL)
_BODY = re.compile(r"\n\{\n.*?\n\}\n", re.DOTALL)


@dataclass
class Comments:
    """The comments of a text: those on lines of their own by the line below, others by the line that they end."""

    above: dict[int, str] = field(default_factory=dict)
    behind: dict[int, str] = field(default_factory=dict)


@dataclass
class Unit:
    """The engine as one tree; comments by file; constants that keep their names, with value and meaning."""

    tree: c_ast.FileAST
    comments: dict[str, Comments]
    constants: dict[str, tuple[str, str]]


def read(texts: Mapping[str, str], suffix: str) -> Unit:
    """The engine in the precision of a suffix, from the texts of the files that say it by their names."""
    own = {
        name: text
        for name, text in texts.items()
        if name.endswith((f"_{suffix}.h", f"/hopform_{suffix}.c", "/hopform.h", "/facts.h"))
    }
    formulas = next(name for name in own if name.endswith(f"/formulas_{suffix}.h"))
    own[formulas] = _BODY.sub(_blank, own[formulas])
    constants: dict[str, tuple[str, str]] = {}
    for name, text in own.items():
        if name.endswith((f"/precision_{suffix}.h", "/hopform.h")):
            constants |= {found[1]: (found[2], found[3] or "") for found in _CONSTANT.finditer(text)}
    preprocessor = _FromMemory(own, set(constants))
    preprocessor.parse(next(f'#include "{name}"\n' for name in own if name.endswith(f"/hopform_{suffix}.c")))
    out = io.StringIO()
    preprocessor.write(out)
    tree = c_parser.CParser().parse(out.getvalue())
    return Unit(tree, {name: _comments(text) for name, text in own.items()}, constants)


def _blank(found: re.Match[str]) -> str:
    return ";" + "\n" * found[0].count("\n")


class _FromMemory(Preprocessor):
    """A preprocessor that opens files by the end of their names among texts, and leaves some macros as they are."""

    def __init__(self, texts: Mapping[str, str], kept: set[str]) -> None:
        super().__init__()
        self.line_directive = "#line"
        self.texts, self.kept, self.seen = texts, kept, set[str]()

    def on_include_not_found(self, is_malformed: bool, is_system: bool, curdir: str, path: str) -> Any:
        raise OutputDirective(Action.IgnoreAndRemove)

    def on_file_open(self, is_system_include: bool, path: str) -> Any:
        raise FileNotFoundError(path)

    def include(self, tokens: Any, original_line: Any = None) -> Any:
        path = "".join(token.value for token in tokens).strip()[1:-1]
        if path in self.seen:
            return
        self.seen.add(path)
        text, name = SYSTEM.get(path), path
        if text is None:
            name = next((name for name in self.texts if name == path or name.endswith(f"/{path}")), "")
            text = self.texts.get(name, "")
        yield from self.parsegen(text, name, name)

    def on_directive_handle(self, directive: Any, tokens: Any, if_passthru: bool, preceding: Any) -> Any:
        if directive.value == "define" and next(t.value for t in tokens if t.type not in self.t_WS) in self.kept:
            raise OutputDirective(Action.IgnoreAndRemove)
        return True

    def on_comment(self, token: Any) -> Any:
        return None


def _comments(text: str) -> Comments:
    found = Comments()
    for comment in _COMMENT.finditer(text):
        first = text.count("\n", 0, comment.start()) + 1
        last = first + comment[0].count("\n")
        words = re.sub(r"\n[ ]*\*? ?", "\n", comment["text"].strip("*< "))
        begins = text.rfind("\n", 0, comment.start()) + 1
        if text[begins : comment.start()].strip():
            found.behind[last] = words
        else:
            found.above[last + 1] = words
    return found
