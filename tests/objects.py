"""Objects of the library that several tests link: each source is compiled once per command and run of the tests."""

import hashlib
import os
import subprocess
from pathlib import Path

from tests.conformance.firmware.targets import C


def compiled(store: Path, command: tuple[str, ...], source: Path) -> Path:
    """The object of a source of generated/c, in a folder that all processes of the run share."""
    whole = [*command, "-I", str(C / "include"), "-c", str(source)]
    made = store / f"{source.stem}_{hashlib.sha256(' '.join(whole).encode()).hexdigest()[:16]}.o"
    if not made.exists():
        aside = made.with_suffix(f".{os.getpid()}.tmp")
        done = subprocess.run([*whole, "-o", str(aside)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        aside.replace(made)
    return made
