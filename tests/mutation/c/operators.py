"""How a C source is broken in one place: operators on its tokens, each a change of text.

| operator | what it does |
| --- | --- |
| relational | `<` `<=` `>` `>=` `==` `!=` becomes its neighbour or its opposite |
| arithmetic | binary `+ -` and `* /` change places, so do `+= -=`, `*= /=`, `++ --` |
| logical | `&&` and `||` change places |
| negation | the condition of an `if`, a `while` or a `?:` is negated; a `!` is dropped |
| constant | an integer grows by 1, a number is doubled, zero becomes 1; `true` and `false` change places |
| sign | a unary minus is dropped |
| call | `fabs`, `sqrt` are dropped from around their argument |
| arguments | two neighbouring arguments of a call change places |
| statement | an assignment, a call, a `break` or a `continue` is removed |
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

_TOKEN = re.compile(
    r"(?P<skip>/\*.*?\*/|//[^\n]*|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*)"
    r"|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[uUfFlL]*)"
    r"|(?P<word>[A-Za-z_]\w*)|(?P<string>\"(?:\\.|[^\"])*\")"
    r"|(?P<sign><<=|>>=|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%<>=!&|^~?:;,.(){}\[\]])",
    re.DOTALL | re.MULTILINE,
)
_RELATIONAL = {"<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "==": ("!=",), "!=": ("==",)}
_ARITHMETIC = {
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "+=": "-=",
    "-=": "+=",
    "*=": "/=",
    "/=": "*=",
    "++": "--",
    "--": "++",
}
_LOGICAL = {"&&": "||", "||": "&&"}
_OPEN = {"(": ")", "[": "]", "{": "}"}
_KEYWORDS = {"if", "while", "for", "switch", "return", "sizeof", "else", "case", "const", "static", "enum", "typedef"}


class Token(NamedTuple):
    kind: str
    text: str
    start: int
    end: int


@dataclass(frozen=True)
class Mutant:
    """One change of a file's text."""

    file: str
    operator: str
    start: int
    end: int
    new: str

    def apply(self, text: str) -> str:
        return text[: self.start] + self.new + text[self.end :]

    def describe(self, text: str) -> str:
        line = text.count("\n", 0, self.start) + 1
        whole = text.splitlines()[line - 1].strip()
        return f"{self.file}:{line}: {self.operator}: `{text[self.start : self.end]}` -> `{self.new}` in `{whole}`"


def tokens_of(text: str) -> list[Token]:
    found = (Token(str(m.lastgroup), m.group(), m.start(), m.end()) for m in _TOKEN.finditer(text))
    return [token for token in found if token.kind != "skip"]


def _partners(tokens: list[Token]) -> dict[int, int]:
    """The closing bracket of each opening one."""
    stack: list[int] = []
    pairs = {}
    for place, token in enumerate(tokens):
        if token.text in _OPEN:
            stack.append(place)
        elif token.text in _OPEN.values():
            pairs[stack.pop()] = place
    return pairs


def _is_binary(tokens: list[Token], text: str, place: int) -> bool:
    """An operator between two values; `double *x` has a gap on one side alone."""
    before, here, after = tokens[place - 1], tokens[place], tokens[place + 1]
    ends_value = before.kind == "number" or before.text in (")", "]") or before.kind == "word"
    gaps = text[before.end : here.start] != "", text[here.end : after.start] != ""
    return ends_value and before.text not in _KEYWORDS and (here.text != "*" or gaps[0] == gaps[1])


def _number(text: str) -> str:
    suffix = text[len(text.rstrip("uUfFlL")) :]
    value = text[: len(text) - len(suffix)]
    if re.fullmatch(r"\d+", value):
        return f"{int(value) + 1}{suffix}"
    return f"{2.0 * float(value)!r}{suffix}" if float(value) else f"1.0{suffix}"


def mutants_of(file: str, text: str) -> Iterator[Mutant]:
    """Every mutant of a source, in the order of its text; not of what HOPFORM_LIBM puts in another's place."""
    tokens = tokens_of(text)
    pairs = _partners(tokens)
    optional = [
        match.span() for match in re.finditer(r"^#ifdef HOPFORM_LIBM$.*?^#else$", text, re.MULTILINE | re.DOTALL)
    ]
    for place, token in enumerate(tokens):
        if any(start <= token.start < end for start, end in optional):
            continue
        for operator, start, end, new in _at(tokens, pairs, text, place, token):
            yield Mutant(file, operator, start, end, new)


Change = tuple[str, int, int, str]


def _at(tokens: list[Token], pairs: dict[int, int], text: str, place: int, token: Token) -> Iterator[Change]:
    before = tokens[place - 1].text if place else ";"
    if before in (";", "{", "}") and token.kind == "word":
        yield from _statement(tokens, text, place)
    if token.text in ("if", "while", "?", "("):
        yield from _around(tokens, pairs, text, place)
        return
    for other in _RELATIONAL.get(token.text, ()):
        yield "relational", token.start, token.end, other
    if token.text in _ARITHMETIC:
        one_sided = token.text in ("++", "--") or len(token.text) == 2
        if one_sided or _is_binary(tokens, text, place):
            yield "arithmetic", token.start, token.end, _ARITHMETIC[token.text]
        elif token.text == "-":
            yield "sign", token.start, token.end, ""
    elif token.text in _LOGICAL:
        yield "logical", token.start, token.end, _LOGICAL[token.text]
    elif token.text == "!":
        yield "negation", token.start, token.end, ""
    elif token.text in ("true", "false"):
        yield "constant", token.start, token.end, "false" if token.text == "true" else "true"
    elif token.kind == "number":
        yield "constant", token.start, token.end, _number(token.text)


def _around(tokens: list[Token], pairs: dict[int, int], text: str, place: int) -> Iterator[Change]:
    """What changes a condition as a whole, or the arguments of a call."""
    token, before = tokens[place], tokens[place - 1]
    if token.text in ("if", "while"):
        opening, closing = place + 1, pairs[place + 1]
        inside = text[tokens[opening].end : tokens[closing].start]
        yield "negation", tokens[opening].end, tokens[closing].start, f"!({inside})"
    elif token.text == "?":
        yield from _swapped_arms(tokens, text, place)
    elif before.kind == "word" and before.text not in _KEYWORDS:
        yield from _arguments(tokens, pairs, text, place)


def _swapped_arms(tokens: list[Token], text: str, place: int) -> Iterator[Change]:
    """`c ? a : b` with a and b in each other's places: the condition negated."""
    depth, colon = 0, None
    for n in range(place + 1, len(tokens)):
        here = tokens[n].text
        if here == "?" and colon is None:
            depth += 1
        if here == ":" and colon is None:
            if depth == 0:
                colon = n
                continue
            depth -= 1
        if here in _OPEN:
            depth += 100
        if here in _OPEN.values():
            depth -= 100
        if colon is not None and (depth < 0 or (here in (",", ";") and depth == 0)):
            a = text[tokens[place].end : tokens[colon].start]
            b = text[tokens[colon].end : tokens[n].start]
            yield "negation", tokens[place].end, tokens[n].start, f"{b} : {a}"
            return


def _arguments(tokens: list[Token], pairs: dict[int, int], text: str, place: int) -> Iterator[Change]:
    name, closing = tokens[place - 1], pairs[place]
    if name.text in ("fabs", "sqrt", "fabsf", "sqrtf"):
        yield "call", name.start, name.end, ""
    if tokens[closing + 1].text == "{" or tokens[place - 2].kind == "word" and tokens[place - 2].text not in _KEYWORDS:
        return  # a definition
    commas, depth = [place], 0
    for n in range(place + 1, closing):
        depth += (tokens[n].text in _OPEN) - (tokens[n].text in _OPEN.values())
        if tokens[n].text == "," and depth == 0:
            commas.append(n)
    commas.append(closing)
    for one, two, three in zip(commas, commas[1:], commas[2:], strict=False):
        a = text[tokens[one].end : tokens[two].start].strip()
        b = text[tokens[two].end : tokens[three].start].strip()
        if a != b:
            yield "arguments", tokens[one].end, tokens[three].start, f"{b}, {a}"


def _statement(tokens: list[Token], text: str, place: int) -> Iterator[Change]:
    """An assignment, a call, or a way out of a loop."""
    end = place
    while tokens[end].text not in (";", "{", "}"):
        end += 1
    words = [token.text for token in tokens[place:end]]
    if tokens[end].text != ";" or not words:
        return
    jumps = words in (["break"], ["continue"])
    value = r"[A-Za-z_]\w*((->|\.)\w+|\[[^\]]*\])*"
    whole = text[tokens[place].start : tokens[end].start]
    assigns = re.match(rf"{value}\s*([-+*/]?=[^=]|\+\+|--)", whole)
    calls = re.match(r"[A-Za-z_]\w*\(", whole) and words[0] not in _KEYWORDS
    if jumps or assigns or calls:
        yield "statement", tokens[place].start, tokens[end].start, ""
