"""The controller against brute force at random touchdowns: `python -m tests.scan --count 10000`.

Exit code 1 if anything is wrong.
"""

import argparse
import math
import os
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed

import numpy as np

import hopform
from tests.scan import Findings, compare, draw_touchdowns

CHUNK = 50


def _part(name: str, seed: int, step: float) -> Findings:
    robot = hopform.load_robot(name)
    return compare(robot, draw_touchdowns(robot, seed, CHUNK), step)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--step", type=float, default=1e-4, help="[A]")
    parser.add_argument("--seed", type=int, default=secrets.randbits(32))
    parser.add_argument("--robots", nargs="+", default=["hopper_c", "hopper_b"])
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    failed = False
    for name in options.robots:
        begin, total = time.monotonic(), Findings()
        with ProcessPoolExecutor(os.cpu_count()) as pool:
            seeds = range(options.seed, options.seed + math.ceil(options.count / CHUNK))
            for done in as_completed([pool.submit(_part, name, seed, options.step) for seed in seeds]):
                total.add(done.result())
        wrong = {each: getattr(total, each) for each in ("smaller", "nearer", "untrue")}
        print(f"{name}: {len(total.solved)} touchdowns, currents in steps of {options.step:g} A, {total.statuses}; stances "
              f"solved: mean {np.mean(total.solved):.1f}, median {np.median(total.solved):.0f}, most {max(total.solved)}; "
              + ", ".join(f"{len(cases)} {each}" for each, cases in wrong.items())
              + f"; {time.monotonic() - begin:.0f} s", flush=True)  # fmt: skip
        for status in sorted(total.statuses):
            of = [n for n, word in zip(total.solved, total.words, strict=True) if word == status]
            print(f"  {status}: mean {np.mean(of):.1f}, median {np.median(of):.0f}, most {max(of)}")
        for each, cases in wrong.items():
            for case in cases[:20]:
                print(" ", each, *case)
                failed = True
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
