"""The texts of a model file by the places where they end up, and what each place makes of them.

A title, a meaning or a unit is a printable line of any characters. What renders one asks for its place here, and
templates have the places as filters. Names are identifiers, which are safe in all of them; C's spelling is `names.in_c`.
"""

import html
import json
from collections.abc import Callable, Mapping

BROKEN = "\ue000"
"""What keeps a text from being read as the name of a precision until that is put in: no printable line has it."""


def comment_of_c(text: str) -> str:
    """Between /* and */, where nothing ends the comment or begins another, and no precision is put in.

    >>> comment_of_c("a */ b /* c")
    'a * / b / * c'
    """
    return text.replace("*/", "* /").replace("/*", "/ *").replace("_real", f"_{BROKEN}real")


def docstring(text: str) -> str:
    """Between three quotes of Python.

    >>> print(docstring('C:\\\\new "x"'))
    C:\\\\new "x\\"
    """
    escaped = text.replace("\\", r"\\").replace('"""', r"\"\"\"")
    return f'{escaped[:-1]}\\"' if escaped.endswith('"') and not escaped.endswith(r"\"") else escaped


def raw_docstring(text: str) -> str:
    """Between r and three quotes of Python, before a full stop or the end of a line: nothing is escaped in there."""
    return text.replace('"""', "'''")


def string(text: str) -> str:
    """A string of Python or JSON, with its quotes."""
    return json.dumps(text, ensure_ascii=False)


def string_of_c(text: str) -> str:
    """A string of C, with its quotes, in which no precision is put in."""
    return string(text).replace("_real", f"_{BROKEN}real")


def string_of_toml(text: str) -> str:
    """A basic string of TOML, which has JSON's escapes, and one for U+007F."""
    return string(text).replace("\x7f", r"\u007f")


def manifest(text: str) -> str:
    """A description in the manifest of any build system: what may end or begin something there is written otherwise.

    >>> manifest('a "b" <c> & $d')
    "a 'b' (c) + d"
    """
    others = {'"': "'", "\\": "/", "<": "(", ">": ")", "&": "+", "$": "", "#": ""}
    return "".join(others.get(character, character) for character in text)


def cell(text: str) -> str:
    """A cell of a table, or a heading, of Markdown: the page shows the text as it is.

    >>> cell("<b> | a & b")
    '&lt;b&gt; \\\\| a &amp; b'
    """
    return html.escape(text, quote=False).replace("|", "\\|")


def math_on_page(latex: str) -> str:
    """LaTeX between dollar signs on a page, in a cell too: it ends neither and has no tag."""
    for sign, command in {"|": r"\vert ", "$": r"\mathdollar ", "<": r"\lt ", ">": r"\gt "}.items():
        latex = latex.replace(sign, command)
    return latex


def line(text: str) -> str:
    """The rest of a line behind # or %, which only the end of the line ends: a printable line has none."""
    return text


PLACES: Mapping[str, Callable[[str], str]] = {
    place.__name__: place
    for place in (comment_of_c, docstring, raw_docstring, string, string_of_c, string_of_toml, cell, math_on_page, line)
}
