"""What is right: every job solved by the 50-digit reference, kept in truth.json.

    python -m tests.bench.truth        makes truth.json anew, on two processes, in a minute

`condition`: of the state, of the AED, by which errors are divided where it is above 1. `margin`: how close the stance
came to another event list.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench import jobs
from tests.oracle import reference

PATH = Path(__file__).with_name("truth.json")
COMMAND = "python -m tests.bench.truth"


def solve(job: tuple[str, int]) -> dict[str, Any]:
    """The reference's answer to one job, rounded to double precision."""
    name, n = job
    (of,) = [of for of in jobs.sets() if of.name == name]
    start = of.start(n)
    exact = reference.solve(of.robot(n), **start, horizon=jobs.HORIZON, max_phases=jobs.MAX_PHASES)
    units = reference.scales(of.robot(n), exact, start["v2"])
    limits = {"horizon": jobs.HORIZON, "max_phases": jobs.MAX_PHASES}
    conditions = [reference.condition(of.robot(n), of=what, **start, **limits) for what in ("state", "aed")]
    kept = exact.events[: jobs.MAX_PHASES - 1]
    return {
        "status": exact.status,
        "duration": float(exact.duration),
        "end": [float(q) for q in exact.final],
        "aed": float(exact.aed),
        "events": [[float(event.time), event.kind] for event in kept],
        "margin": float(exact.margin),
        "condition": conditions,
        "time_unit": float(units["time"]),
        "energy_unit": float(units["energy"]),
    }


def digest(of: jobs.Jobs) -> str:
    """What the inputs of a set are, so that an old truth is not taken for that of other jobs."""
    import hashlib

    return hashlib.sha256(np.ascontiguousarray(of.table).tobytes()).hexdigest()[:16]


def load(path: Path = PATH) -> dict[str, list[dict[str, Any]]]:
    """The truth per set; RuntimeError if it belongs to other jobs than jobs.py draws."""
    stored = json.loads(path.read_text("utf-8"))
    for of in jobs.sets():
        if stored["inputs"][of.name] != digest(of):
            raise RuntimeError(f"{path.name} belongs to other jobs of {of.name}: run `{COMMAND}`")
    return dict(stored["stances"])


def main() -> None:
    sets = jobs.sets()
    todo = [(of.name, n) for of in sets for n in range(len(of))]
    stances: dict[str, list[dict[str, Any]]] = {of.name: [] for of in sets}
    with ProcessPoolExecutor(2) as pool:
        for done, ((name, _), answer) in enumerate(zip(todo, pool.map(solve, todo, chunksize=4), strict=True), 1):
            stances[name].append(answer)
            print(f"\r{done}/{len(todo)} stances", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    head = {"command": COMMAND, "inputs": {of.name: digest(of) for of in sets}}
    lines = [
        f'  "{name}": [\n' + ",\n".join("    " + json.dumps(row) for row in rows) + "\n  ]"
        for name, rows in stances.items()
    ]
    text = json.dumps(head)[:-1] + ', "stances": {\n' + ",\n".join(lines) + "\n}}\n"
    PATH.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
