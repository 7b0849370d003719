"""Mutants of the engine's C by the rules of universalmutator, one of a line, drawn by a seed.

A line is drawn with equal probability, then the order of its mutants. Both draws depend on the seed and on the text of
the line alone, so an edit elsewhere leaves them as they are.
"""

import contextlib
import hashlib
import io
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from universalmutator.mutator import mutants_regexp

RULES = ["universal.rules", "c_like.rules", "c.rules"]
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
BOUNDS = re.compile(r"\b(?:[A-Z]+_)*(?:EPS|UNDERFLOW|MOST)(?:_\w+)?\b")
"""Names of unit roundoff, underflow and caps. A number beside them is a factor of a bound, with room on purpose."""
NUMBER = r"(\D)(\d+)(\D)"
"""Left side of the rules that change a number."""


@dataclass(frozen=True)
class Mutant:
    """A line of a source of the engine, and what stands in its place: several lines if a jump is added to it."""

    file: str
    line: int
    old: str
    new: str

    def apply(self, text: str) -> str:
        lines = text.splitlines(keepends=True)
        return "".join([*lines[: self.line - 1], self.new, *lines[self.line :]])

    def __str__(self) -> str:
        return f"{self.file}:{self.line}\n    -{self.old.strip()}\n    +{' '.join(self.new.split())}"


def without_comments(text: str) -> str:
    """The same code in the same lines: universalmutator passes over a line with a comment, and {- begins one to it."""
    return COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), text).replace("{-", "{ -")


def drawn(seed: int, sources: Mapping[str, str]) -> Iterator[list[Mutant]]:
    """The mutants of each line of the sources, lines and mutants in the order of the draw."""
    lines = list[tuple[bytes, list[Mutant]]]()
    for file, text in sources.items():
        code = without_comments(text).splitlines(keepends=True)
        with contextlib.redirect_stdout(io.StringIO()):
            found = mutants_regexp(code, RULES, ignorePatterns=[])
        of_line = defaultdict[int, list[str]](list)
        for number, new, _, (rule, _) in found:
            if not (rule.pattern == NUMBER and BOUNDS.search(code[number - 1])):
                of_line[number].append(new)
        seen = Counter[str]()
        for number, news in of_line.items():
            place = f"{seed} {file} {code[number - 1]}"
            seen[place] += 1
            mutants = [Mutant(file, number, code[number - 1], new) for new in news]
            mutants.sort(key=lambda mutant: _key(place, mutant.new))
            lines.append((_key(place, str(seen[place])), mutants))
    return (mutants for _, mutants in sorted(lines, key=lambda each: each[0]))


def _key(*parts: str) -> bytes:
    return hashlib.sha256("\0".join(parts).encode()).digest()
