"""What `make lines` counts: code, and neither what is blank nor what only explains."""

import pytest

from tools.lines import PRODUCT, lines_of, room_of

SOURCES = {
    "a.py": ('"""Says what.\n\nAt length.\n"""\n\n# why\nx = 1  # here\n"""Says x."""\ny = """two\n\nlines"""\n', 3),
    "b.py": ('def f():\n    """Says f."""\n    return (\n        1\n    )\n', 4),
    "a.c": ('/* what\n * it is */\n#include "a.h"\n\n// why\nint a; /* here */\nchar *b = "/* no */";\n', 3),
    "a.h.j2": ("{# for its readers #}\n/* what */\n{% for f in fields %}\nint {{ f }};\n{% endfor %}\n", 3),
    "a.py.j2": ('"""Says what.\n\n{{ source }}\n"""\n# why\n{# who #}\nx = {{ x }}\n', 1),
    "a.toml": ("# why\n\n[a]\nb = 1 # here\n", 2),
    "CMakeLists.txt": ("# why\nproject(a)\n", 1),
    "a.sh": ("#!/bin/sh\nset -eu\n", 1),
    "a.pdsc": ("<!-- why\n-->\n<a/>\n", 1),
}


@pytest.mark.parametrize("name", SOURCES)
def test_what_counts_is_neither_blank_nor_comment_nor_docstring(name):
    text, count = SOURCES[name]
    assert lines_of(name, text) == count


def test_each_file_has_one_room():
    assert [room_of(f"{room}/a.py") for room in PRODUCT] == list(PRODUCT)
    assert room_of("tests/conformance/test_stance.py") == "tests"
    assert room_of("tests/fuzz/source.h") == room_of("tests/mutation/evaluate.py") == "tests' tools"
    for name in ("generated/c/src/stance_f32.c", "docs/a.md", "tests/bench/truth.json", "tests/fuzz/found/a_f32"):
        assert room_of(name) is None
