"""The controller against brute force at random touchdowns: `python -m tests.conformance.currents --count 10000`, or
with random robots, three touchdowns each, `python -m tests.conformance.currents --count 9000 --robots random`; of
robots `at_rest`, with more friction at rest than in motion, up to three more where the apex jumps.

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
from tests.conformance.currents import Findings, compare, compare_single, draw_at_jumps, draw_robot, draw_touchdowns

CHUNK = 50
EACH = 3
"""Touchdowns of a random robot."""
SHARE = 1.0 / 2000.0
"""Of a random robot's u_max: a step."""


def _random_part(seed: int, at_rest: bool) -> Findings:
    found = Findings()
    for n in range(math.ceil(CHUNK / EACH)):
        robot = draw_robot(CHUNK * seed + n, at_rest)
        drops = draw_touchdowns(robot, seed, EACH) + (draw_at_jumps(robot, seed) if at_rest else [])
        found.add(compare(robot, drops, SHARE * robot.u_max))
    return found


def _part(name: str, seed: int, step: float) -> Findings:
    if name in ("random", "at_rest"):
        return _random_part(seed, name == "at_rest")
    robot = hopform.load_robot(name)
    touchdowns = draw_touchdowns(robot, seed, CHUNK)
    found = compare(robot, touchdowns, step)
    found.add(compare_single(robot, touchdowns))
    return found


WRONG = ("smaller", "nearer", "untrue", "single")


def progress(found: Findings) -> str:
    counts = (f"{len(getattr(found, each))} {each}" for each in WRONG)
    return f"{len(found.solved)} touchdowns, {', '.join(counts)}"


def report(found: Findings) -> bool:
    """Print what was seen; whether anything is wrong."""
    for status, number in sorted(found.statuses.items()):
        of = [n for n, word in zip(found.solved, found.words, strict=True) if word == status]
        print(
            f"  {number} {status}: stances solved {np.mean(of):.1f} (mean), {np.median(of):.0f} (median), "
            f"{max(of)} (most)"
        )
    print(f"  float32, where reached: at most {found.worst_single:.1e} m off in double precision")
    wrong = {each: getattr(found, each) for each in WRONG}
    print("  " + ", ".join(f"{len(cases)} {each}" for each, cases in wrong.items()), flush=True)
    for each, cases in wrong.items():
        for case in cases[:20]:
            print("   ", each, *case)
    return any(wrong.values())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--step", type=float, default=1e-4, help="[A]")
    parser.add_argument("--seed", type=int, default=secrets.randbits(32))
    parser.add_argument("--robots", nargs="+", default=["hopper_c", "hopper_b"], help="names, random, or at_rest")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    failed = False
    for name in options.robots:
        begin, total = time.monotonic(), Findings()
        with ProcessPoolExecutor(options.processes) as pool:
            seeds = range(options.seed, options.seed + math.ceil(options.count / CHUNK))
            for done in as_completed([pool.submit(_part, name, seed, options.step) for seed in seeds]):
                total.add(done.result())
                print(f"\r{name}: {progress(total)}", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        print(f"{name}: {len(total.solved)} touchdowns, {time.monotonic() - begin:.0f} s", flush=True)
        failed |= report(total)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
