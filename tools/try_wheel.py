"""`python tools/try_wheel.py DIR` installs the wheel of DIR for this computer into a new environment, with what it
requires from an index, and compares the digests that it prints with those on record. It needs Python alone.

The release workflow runs it on computers where tools/wheels.py cannot run what it compiled.
"""

import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "tests" / "repository" / "gate" / "record.json"


def main(dist: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder, "Scripts" if os.name == "nt" else "bin", "python")

        def run(*arguments: str) -> str:
            return subprocess.run([python, "-m", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout

        run(
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--no-index",
            "--find-links",
            dist,
            "--only-binary=:all:",
            "hopform",
        )
        run("pip", "install", "--quiet", "hopform")  # it is there: this installs what it requires
        run("hopform", "stance", "--robot", "hopper_c", "--height", "0.20", "--explain")
        found = {line.split()[0][-3:]: line.split()[-1] for line in run("hopform", "selftest").splitlines()}
    recorded = json.loads(RECORD.read_text("utf-8"))["selftest"]
    if found != recorded:
        sys.exit(f"hopform: the wheel prints {found}, on record is {recorded}")
    print(f"the wheel prints the digests on record: {found}")


if __name__ == "__main__":
    main(sys.argv[1])
