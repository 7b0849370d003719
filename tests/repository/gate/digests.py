"""The digests of this computer's selftest beside those on record: `python -m tests.repository.gate.digests`."""

import ctypes
import json
from pathlib import Path

from tests.repository.gate import answers

ROOT = Path(__file__).resolve().parents[3]
RECORD = Path(__file__).with_name("record.json")
"""What is committed of the last gate: the selftest's digests."""


def found() -> dict[str, str]:
    """The selftest's digests of this checkout's library."""
    library = next((ROOT / "runtime" / "hopform").glob("_libhopform.*"), None)
    if library is None:
        raise FileNotFoundError("there is no compiled library: run `make run` first")
    handle = ctypes.CDLL(str(library))
    return {precision: f"{answers.digest(handle, precision)[0]:08x}" for precision in ("f32", "f64")}


def moved(digest: dict[str, str]) -> list[str]:
    """What differs from the record, in a line; nothing if all is well."""
    known = json.loads(RECORD.read_text("utf-8"))["selftest"]
    return [] if digest == known else [f"selftest: {known} on record, {digest} now"]


def main() -> int:
    digest = found()
    lines = moved(digest)
    print(*(lines or [f"the selftest's digests are those on record: {digest}"]), sep="\n")
    return 1 if lines else 0


if __name__ == "__main__":
    raise SystemExit(main())
