"""Lines of Python: docstrings that are filled, and code that is broken where it is wider than a page."""

import re
import textwrap
from collections.abc import Iterator

WIDEST = 120


def docstring(text: str, depth: int = 1) -> list[str]:
    """A comment as a docstring: its paragraphs filled."""
    indent = "    " * depth
    paragraphs = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text.strip())]
    lines = []
    for n, paragraph in enumerate(paragraphs):
        room = WIDEST - len(indent) - (3 if n == 0 else 0)
        lines += ([""] if n else []) + textwrap.wrap(paragraph, room, break_long_words=False, break_on_hyphens=False)
    if len(lines) <= 1 and len(lines[0] if lines else "") + len(indent) + 6 <= WIDEST:
        return [f'{indent}"""{lines[0] if lines else ""}"""']
    return [f'{indent}"""{lines[0]}', *(f"{indent}{line}".rstrip() for line in lines[1:]), f'{indent}"""']


def wrapped(line: str) -> Iterator[str]:
    """A line, broken within brackets where it is wider than a page; its comment on a line of its own before it."""
    if len(line) <= WIDEST:
        yield line
        return
    indent = line[: len(line) - len(line.lstrip())]
    code, mark, comment = line.partition("  # ")
    if code.strip().startswith("#"):
        mark, comment, code = "#", line.strip()[2:], ""
    if mark:
        yield from textwrap.wrap(comment, WIDEST, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")
        yield from wrapped(code) if code else ()
        return
    if _place_to_break(line, 0) is None:
        found = re.match(r" *(?:return|[^ =]+(?: [+*/-]?=)) ", line)
        if found is None:
            yield line
            return
        line = f"{found[0]}({line[found.end() :]})"
    depth = 0
    while len(line) > WIDEST and (place := _place_to_break(line, depth)) is not None:
        depth += sum((letter in "([{") - (letter in ")]}") for letter in line[:place])
        yield line[:place].rstrip()
        line = f"{indent}    {'    ' if line.lstrip().startswith('def ') else ''}{line[place:].lstrip()}"
    yield line


def _place_to_break(line: str, depth: int) -> int | None:
    """The last place within a page, least deep in brackets, behind a comma or before an operator."""
    best, quoted = {}, False
    begins = len(line) - len(line.lstrip()) + 20
    for n, letter in enumerate(line[:WIDEST]):
        quoted ^= letter == '"'
        if quoted:
            continue
        depth += (letter in "([{") - (letter in ")]}")
        if depth > 0 and n > begins:
            if letter == ",":
                best[depth] = n + 1
            elif re.match(r" (?:and|or|if|else|\+|-) ", line[n:]):
                best[depth] = n
    far = {level: place for level, place in best.items() if place > WIDEST // 2}
    least = min(far or best, default=None)
    return None if least is None else best[least]
