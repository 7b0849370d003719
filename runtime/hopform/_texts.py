"""Texts of people by the places where they end up in what the package writes, and what each place makes of them.

What is rendered of a model file has its table in `derive/emit/texts.py`; rooms do not share one.
"""

import html
import json
import re

from hopform._errors import printable


def string_of_toml(text: str) -> str:
    """A basic string of TOML, which has JSON's escapes, and one for U+007F."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", r"\u007f")


def key_of_toml(name: str) -> str:
    """A name as a key of TOML, which takes letters beyond ASCII in quotes alone."""
    return name if name.isascii() else string_of_toml(name)


def line(text: str) -> str:
    """The rest of a line behind #: what would end it, or what no file of text may have, is escaped as Python does."""
    return printable(text)


def comment_of_c(text: str) -> str:
    """Between /* and */, where nothing ends the comment or begins another.

    >>> comment_of_c("a */ b /* c")
    'a * / b / * c'
    """
    return printable(text).replace("*/", "* /").replace("/*", "/ *")


def comment_of_xml(text: str) -> str:
    """Between <!-- and -->, where no two hyphens may stand side by side.

    >>> comment_of_xml("a---b.csv")
    'a- - -b.csv'
    """
    return re.sub("-(?=-)", "- ", printable(text))


def in_html(text: str) -> str:
    """Between tags of HTML, or in quotes within one."""
    return html.escape(text)


_MARKUP = re.compile(r"[\\`*{}\[\]<>#|&$~]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")


def markdown(text: str) -> str:
    """A text in one line of Markdown that is shown as it is: no markup, no HTML, no formula, no cell's end."""
    return _MARKUP.sub(r"\\\g<0>", printable(" ".join(text.split())))
