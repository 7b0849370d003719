"""`python tools/lines.py` counts the lines of each room, and fails if the product has more than it may have.

A line counts if it is not blank and not only comment or docstring; what a program has written, and data, count nothing.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections import Counter
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parent.parent
MOST = 17_500 + 1_500 + 1_000 + 1_500  # the core; mechanisms, identification, and what shows itself
PRODUCT = ("derive", "templates", "runtime/hopform", "runtime/engine", "tools")
TEST_TOOLS = r"^tests/(mutation|fuzz|bench)/|/branch_coverage/|/conformance/(confidence|currents|switchover)"
NO_SOURCE = {".json", ".png", ".svg", ".typed", ".npz", ".csv"}

SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
QUOTED = r'"(?:\\.|[^"\\\n])*"|' + r"'(?:\\.|[^'\\\n])*'"
SUFFIXES_OF_C = {".c", ".h", ".inc", ".cpp", ".ino", ".S", ".ld"}


def lines_of(name: str, text: str) -> int:
    """How many lines of a source count; a template is what it becomes, with its tags."""
    path = PurePosixPath(name)
    if path.suffix == ".j2":
        text, path = re.sub(r"\{#.*?#\}", "", text, flags=re.DOTALL), path.with_suffix("")
        if path.suffix == ".py":  # with tags in it, it is no Python yet
            text = re.sub(r'^\s*"""(?:.|\n)*?"""$', "", text, flags=re.MULTILINE)
    elif path.suffix == ".py":
        return _lines_of_python(text)
    if path.suffix in SUFFIXES_OF_C:
        code = re.sub(rf"({QUOTED})|/\*(?:.|\n)*?\*/|//[^\n]*", lambda match: match[1] or "", text).splitlines()
    elif path.suffix in {".md", ".pdsc"}:
        code = re.sub(r"<!--(?:.|\n)*?-->", "", text).splitlines()
    else:
        code = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    return sum(bool(line.strip()) for line in code)


def _lines_of_python(text: str) -> int:
    lines, code = text.splitlines(), set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in SILENT:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            code.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return sum(bool(lines[number - 1].strip()) for number in code)


def room_of(name: str) -> str | None:
    """The room in which a file stands, None for what is no source of ours."""
    if PurePosixPath(name).suffix in NO_SOURCE or name.endswith("LICENSE"):
        return None
    if name.startswith("tests/"):
        return None if "/found/" in name else "tests' tools" if re.search(TEST_TOOLS, name) else "tests"
    return next((room for room in PRODUCT if name.startswith(f"{room}/")), None)


def main() -> int:
    listed = subprocess.run(
        ["git", "ls-files", "-coz", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    count = Counter[str]()
    for name in filter(None, listed.split("\0")):
        room = room_of(name)
        if room and (ROOT / name).is_file():
            text = (ROOT / name).read_text("utf-8")
            written = re.match(r"\W*(?:Written|Generated) by `", text)
            count[room] += 0 if written else lines_of(name, text)
    product = sum(count[room] for room in PRODUCT)
    for room in (*PRODUCT, "product", "tests' tools", "tests"):
        print(f"{room:<16} {product if room == 'product' else count[room]:>6}")
    if product > MOST:
        print(f"hopform: the product has {product} lines, more than {MOST}", file=sys.stderr)
    return int(product > MOST)


if __name__ == "__main__":
    sys.exit(main())
