"""`python -m tests.conformance.kernels` tries every float32 input of every kernel in C against double precision,
prints the errors.

`--of N` tries one input in N, spread evenly over all of them. More than LIMITS is a failure.
"""

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.conformance.firmware.targets import COMMON, ROOT, C, run

SOURCE = Path(__file__).with_name("kernels.c")
IMAGE = ROOT / "out" / "kernels"
LIMITS = {
    "exp(-x)": ("ulp", 1.2), "1-exp(-x)": ("ulp", 1.8), "sin(x),x<1e4": ("absolute", 1.2e-7),
    "cos(x),x<=1e4": ("absolute", 1.2e-7),
    "ln(x)": ("ulp", 3.0), "cbrt(x)": ("ulp", 0.6667), "artanh(s)/s": ("ulp", 0.55), "angle(x,y)": ("ulp", 3.0),
    "t*phi1(-t)": ("ulp", 1.5), "t^2*phi2(-t)": ("ulp", 3.0),
}  # fmt: skip
"""Limits: units of the last place where a result keeps its relative accuracy, else absolute."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.conformance.kernels", description=__doc__)
    parser.add_argument("--of", type=int, default=1, help="one input in so many")
    chosen = parser.parse_args()
    IMAGE.parent.mkdir(exist_ok=True)
    include = ["-I", str(C / "include"), "-I", str(C / "src")]
    run(["cc", *COMMON, "-D_GNU_SOURCE", "-O2", *include, str(SOURCE), "-o", str(IMAGE), "-lm"])
    jobs = os.cpu_count() or 1
    with ThreadPoolExecutor(jobs) as pool:
        commands = [[str(IMAGE), str(n), str(jobs * chosen.of)] for n in range(jobs)]
        parts = list(pool.map(lambda command: subprocess.check_output(command, text=True).splitlines(), commands))
    bad = 0
    print(
        "| kernel | inputs | largest error, ulp | at | largest error, absolute | at |\n"
        "| --- | --: | --: | --: | --: | --: |"
    )
    for lines in zip(*parts, strict=True):
        name = lines[0].split()[0]
        rows = [list(map(float, line.split()[1:])) for line in lines]
        ulp, at = max((row[1], row[2]) for row in rows)
        absolute, where = max((row[3], row[4]) for row in rows)
        print(
            f"| {name} | {sum(int(row[0]) for row in rows):,} | {ulp:.3g} | {at:.9g} | {absolute:.3g} | {where:.9g} |"
        )
        kind, limit = LIMITS[name]
        bad += (ulp if kind == "ulp" else absolute) > limit
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
