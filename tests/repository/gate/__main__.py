"""Whether a change that should move no number moves none: `python -m tests.repository.gate BASE`.

Both trees, the commit BASE and this checkout, are built here and compared: the instructions and constants of every
function of the generated C (names apart, several compilers and targets), the digests of the selftest, 60 000 random
stances, 10 000 flights, 10 000 commands, the data of every figure, and the list of
public names. Exit code 1, and what differs, where anything moved.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hopform_solver.records import ROBOT_FIELDS
from tests.conformance.flights import random_flight
from tests.conformance.random_stances import draw_stances
from tests.repository import released
from tests.repository.gate import digests, objects

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent
OUT = ROOT / "out" / "gate"

STANCES, FLIGHTS, COMMANDS, SEED = 60_000, 10_000, 10_000, 20261122


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.repository.gate", description=__doc__.splitlines()[0])
    parser.add_argument("base", metavar="BASE", help="the commit to compare with")
    parser.add_argument("--record", action="store_true", help="write the digests that were found")
    parser.add_argument(
        "--without", choices=("objects", "answers"), action="append", default=[], help="leave a part out"
    )
    chosen = parser.parse_args()
    base = checkout(chosen.base)
    moved: list[str] = []
    if "objects" not in chosen.without:
        moved += compare_objects(base)
    if "answers" not in chosen.without:
        moved += compare_answers(base)
    moved += compare_record(chosen.record)
    for line in moved:
        print(f"gate: {line}")
    print(
        f"gate: {len(moved)} differences against {chosen.base}"
        if moved
        else f"gate: nothing moved against {chosen.base}"
    )
    return 1 if moved else 0


def checkout(commit: str) -> Path:
    """The tree of a commit, beside which its library is built."""
    name = subprocess.run(
        ["git", "rev-parse", "--verify", f"{commit}^{{commit}}"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()
    folder = OUT / name[:12]
    if not folder.is_dir():
        aside = OUT / f"{name[:12]}.part"
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir(parents=True)
        archive = subprocess.run(["git", "archive", name], cwd=ROOT, check=True, capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", str(aside)], input=archive, check=True)
        aside.rename(folder)
    return folder


def compare_objects(base: Path) -> list[str]:
    """Functions and constants that only one of the trees has, by target."""
    moved = []
    for target in objects.here():
        old, new = objects.parts(base, target), objects.parts(ROOT, target)
        for precision in old:
            lost, gained = objects.difference(old[precision], new[precision])
            print(
                f"{target} {precision}: {len(old[precision])} functions and constants, "
                f"{len(lost)} lost, {len(gained)} gained"
            )
            if lost or gained:
                moved.append(f"{target} {precision}: only before: {' '.join(lost)}; only now: {' '.join(gained)}")
    return moved


def compare_answers(base: Path) -> list[str]:
    """Answers whose bits differ."""
    inputs = OUT / "inputs.npz"
    np.savez(inputs, stances=draw_stances(SEED, STANCES), flights=draw_flights(), touchdowns=draw_touchdowns())
    old, new = answers_of(base, inputs), answers_of(ROOT, inputs)
    moved = [f"answers: only before: {name}" for name in sorted(old.keys() - new.keys())]
    moved += [f"answers: only now: {name}" for name in sorted(new.keys() - old.keys())]
    common = sorted(old.keys() & new.keys())
    for name in common:
        one, other = old[name], new[name]
        if one.shape != other.shape or one.dtype != other.dtype:
            moved.append(f"{name}: {one.dtype}{one.shape} before, {other.dtype}{other.shape} now")
        elif one.tobytes() != other.tobytes():
            apart = np.flatnonzero(bits(one) != bits(other))
            values = f"{one.ravel()[apart[0]]!r} before, {other.ravel()[apart[0]]!r} now"
            moved.append(f"{name}: {apart.size} of {one.size} differ, the first at {apart[0]}: {values}")
    print(f"answers: {len(common)} arrays, {sum(old[name].size for name in common)} numbers compared")
    return moved


def bits(values: Any) -> Any:
    """Each number as bytes, so that -0 is not 0 and NaN equals itself."""
    flat = np.ascontiguousarray(values).ravel()
    return flat if flat.dtype.kind in "US" else flat.view(f"V{flat.itemsize}")


def answers_of(tree: Path, inputs: Path) -> dict[str, Any]:
    """What the checkout in `tree` answers, computed in a process that imports it alone."""
    out = OUT / f"answers_{tree.name}.npz"
    subprocess.run(
        [sys.executable, str(tree / "tools" / "build_library.py")], cwd=tree, check=True, capture_output=True
    )
    path = os.pathsep.join([str(tree / "runtime"), str(tree / "generated" / "python")])
    environment = os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-P", str(HERE / "answers.py"), str(inputs), str(out)], env=environment, check=True)
    with np.load(out) as found:
        return dict(found)


def draw_flights() -> Any:
    """Random robots and flights, a structured row each."""
    rows, names = [], list[str]()
    for seed in range(FLIGHTS):
        robot, flight = random_flight(seed)
        Kp, Kd = flight["gains"]
        start = {name: flight[name] for name in ("x1", "v1", "v2", "y")}
        row = {field.name: getattr(robot, field.name) for field in ROBOT_FIELDS} | start | {"Kp": Kp, "Kd": Kd}
        names = list(row)
        rows.append(tuple(row.values()))
    return np.array(rows, [(name, float) for name in names])


def draw_touchdowns() -> Any:
    """v2, x1, v1 at touchdown and the desired hop height."""
    draw = np.random.default_rng(SEED)
    drop = draw.uniform(0.02, 0.35, COMMANDS)
    x1 = np.where(draw.random(COMMANDS) < 0.5, 0.0, draw.uniform(0.0, 0.02, COMMANDS))
    v1 = np.where(draw.random(COMMANDS) < 0.5, 0.0, draw.uniform(-0.05, 0.05, COMMANDS))
    return np.stack([-np.sqrt(2.0 * 9.81 * 0.95 * drop), x1, v1, draw.uniform(0.05, 0.3, COMMANDS)], axis=1)


def compare_record(record: bool) -> list[str]:
    """Digests of this checkout against those on record, and what is public against what was released."""
    digest = digests.found()
    if record:
        digests.RECORD.write_text(json.dumps({"selftest": digest}, indent=1) + "\n", "utf-8")
        return []
    before, now = json.loads(released.RECORD.read_text("utf-8")), released.found()
    new = [line for line in released.moved(now, before) if line.endswith(" is gone")]
    return [
        *digests.moved(digest),
        *released.moved(before, now),
        *(line.replace(" is gone", " is new") for line in new),
    ]


if __name__ == "__main__":
    raise SystemExit(main())
