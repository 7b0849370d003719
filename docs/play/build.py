"""`python docs/play/build.py DIR [LINK]` builds the page to play with, DIR/index.html: one file that needs no server.

The library as `hopform export` writes it and play.c are compiled to WebAssembly by the pinned ziglang, and put into the
page with its style, its program and the facts that it shows: quantities, words, robots, digests. LINK leads from the
page to the documentation beside it; without one the page links to nothing, so it works wherever the file lies.
"""

import base64
import importlib.util
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

import hopform
from hopform._export import Wanted, package, selftest
from hopform._robots import Provenance
from hopform._solver.package import records
from hopform._warnings import WARNINGS
from hopform.hopping._commands import OUTCOMES

PAGE = Path(__file__).resolve().parent
ROOT = PAGE.parent.parent
FLAGS = [
    "-target", "wasm32-wasi", "-nostdlib", "-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno",
    "-fno-sanitize=undefined", "-fvisibility=hidden", "-ffunction-sections", "-fdata-sections", "-mbulk-memory",
    "-Wl,--no-entry", "-Wl,--export-dynamic", "-Wl,--gc-sections", "-Wl,--strip-all",
]  # fmt: skip


def wasm() -> bytes:
    """The library and play.c as a module of WebAssembly without imports."""
    zig = importlib.util.find_spec("ziglang")
    if zig is None or zig.origin is None:
        sys.exit("hopform: ziglang is not installed (`make play` installs it)")
    headers = Path(zig.origin).parent / "lib" / "libc" / "include"
    include = [flag for name in ("wasm-wasi-musl", "generic-musl") for flag in ("-isystem", str(headers / name))]
    with tempfile.TemporaryDirectory() as folder:
        for path, text in package(Wanted("cmake")).items():
            if path.parent.name == "amalgamated":
                Path(folder, path.name).write_text(text, "utf-8")
        module = Path(folder, "play.wasm")
        files = [str(PAGE / "play.c"), str(Path(folder, "hopform.c")), "-I", folder, "-o", str(module)]
        subprocess.run([sys.executable, "-m", "ziglang", "cc", *FLAGS, *include, *files], check=True)
        return module.read_bytes()


def facts() -> dict[str, Any]:
    """What the page knows beside the numbers that it asks for; numbers as text, of which some are infinite."""
    sys.path.insert(0, str(ROOT))
    from derive.model import kinds

    fields = hopform.Robot.all_fields()
    robots = {name: hopform.load_robot(name) for name in hopform.ROBOTS}
    tables = (kinds.STATUSES, kinds.COMMANDS, kinds.ENDINGS, kinds.EVENTS, kinds.CURRENT_EVENTS)
    return {
        "fields": [field._asdict() | {"default": text_of(field.default)} for field in fields],
        "robots": {
            name: {
                "description": robot.description,
                "values": {field.name: text_of(getattr(robot, field.name)) for field in fields},
            }
            for name, robot in robots.items()
        },
        "texts": ["name", "description"],
        "fit": Provenance._fields,
        "solved": [field.name for field in hopform.Robot.fields()],
        "domains": {
            name: domain._asdict() | {end: text_of(getattr(domain, end)) for end in ("low", "high")}
            for name, domain in records.DOMAINS.items()
        },
        "warnings": [
            {"conditions": [[*each[:2], bound_of(each[2])] for each in warning.conditions], "text": warning.text}
            for warning in WARNINGS
        ],
        "digests": {name: f"{selftest(dtype):08x}" for name, dtype in (("f32", "float32"), ("f64", "float64"))},
        "outcomes": [OUTCOMES[status] for status in ("completed", "stopped", "tripped")],  # as play_run numbers them
        "words": {kind.table: [asdict(word) for word in kind.words] for kind in tables},
    }


def bound_of(bound: str | float) -> dict[str, str]:
    """What a warning compares with: a reading by its name, or a number."""
    return {"reading": bound} if isinstance(bound, str) else {"number": repr(bound)}


def text_of(number: float | None) -> str | None:
    """JSON has no infinity."""
    return None if number is None else repr(number)


def build(folder: Path, documentation: str = "") -> Path:
    """Write the page, with a link to the documentation if there is one, and return its path."""
    page = (PAGE / "index.html").read_text("utf-8")
    parts = {
        "<!-- licence -->": f"<!--\n{(ROOT / 'LICENSE').read_text('utf-8')}-->",
        "<!-- version -->": hopform.__version__,
        "<!-- documentation -->": documentation and f'<a href="{escape(documentation)}">Documentation</a>',
        "/* play.css */": (PAGE / "play.css").read_text("utf-8"),
        "/* read.js */": (PAGE / "read.js").read_text("utf-8"),
        "/* play.js */": (PAGE / "play.js").read_text("utf-8"),
        'type="application/json">{}': 'type="application/json">' + json.dumps(facts()),
        'type="application/octet-stream">': 'type="application/octet-stream">' + base64.b64encode(wasm()).decode(),
    }
    for place, text in parts.items():
        before, found, after = page.partition(place)
        assert found, place
        page = before + text + after
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "index.html").write_text(page, "utf-8")
    return folder / "index.html"


if __name__ == "__main__":
    print(f"open {build(Path(sys.argv[1]), *sys.argv[2:3])} in a browser")
