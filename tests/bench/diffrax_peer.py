"""diffrax as a peer: Tsit5 with events, all stances in step under vmap:
one call follows each of them to its next event.
"""

from functools import cache
from typing import Any

import numpy as np

from tests.bench.jobs import Jobs, answers
from tests.bench.scipy_peers import _matrix
from tests.oracle import rules
from tests.oracle.rules import NONE, Point

STEPS = 100_000


@cache
def _search(tolerance: float) -> Any:
    """The compiled search of many lanes: how long, which function (NONE), the state there."""
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    jax.config.update("jax_enable_x64", True)

    def event_function(number):
        return lambda t, y, args, **_: args[1][number] @ jnp.append(y, 1.0)

    def one(matrix, functions, z, limit, first):
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, z, args: args[0] @ jnp.append(z, 1.0)),
            diffrax.Tsit5(),
            t0=0.0,
            t1=limit,
            dt0=first,
            y0=z,
            args=(matrix, functions),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=0.01 * tolerance),
            event=diffrax.Event(
                [event_function(number) for number in range(6)], optimistix.Newton(1e-12, 1e-14), direction=False
            ),
            max_steps=STEPS,
            throw=False,
        )
        mask = jnp.stack(found.event_mask)
        return found.ts[-1], jnp.where(mask.any(), jnp.argmax(mask), NONE), found.ys[-1]

    return jax.jit(jax.vmap(one))


def _functions(leg, side_1, side_2, z):
    """The six event functions, linear within a mode: their rows in (x1, v1, v2, y, 1)."""

    def at(v1, v2, y):
        return np.minimum(rules.event_functions(leg, side_1, side_2, Point(z.x1, v1, v2, y)), 1e6)

    rest, rows = at(0.0, 0.0, 0.0), np.zeros((6, 5))
    for n, unit in enumerate(np.eye(3).tolist()):
        rows[:, n + 1] = at(*unit) - rest
    rows[:, 4] = rest
    if side_1 != 0.0 and rest[rules.STOPS] < 1e6:
        rows[rules.STOPS, 0], rows[rules.STOPS, 4] = -side_1, rest[rules.STOPS] + side_1 * z.x1
    return rows


def _walk(job, answer):
    """`rules.chain`, which asks for each search by a yield and is sent what was found."""
    leg = rules.leg_of(job)
    z, side_1, side_2 = rules.begin(job, leg)
    t, phases, count, ending = 0.0, 1, 0, rules.TOO_MANY_PHASES
    while phases <= rules.MAX_PHASES:
        if side_1 == 0.0 and side_2 == 0.0:
            ending = rules.REST
            break
        took, which, z = yield leg, side_1, side_2, z, rules.LONGEST - t
        t += took
        if which in (NONE, rules.LIFTS):
            ending = rules.HORIZON if which == NONE else rules.TAKEOFF
            break
        z, side_1, side_2, kind = rules.pass_event(leg, side_1, side_2, z, which)
        phases += 1
        if kind != 0 and phases <= rules.MAX_PHASES:
            answer[rules.HEAD + 2 * count], answer[rules.HEAD + 2 * count + 1] = t, kind
            count += 1
    y = 0.0 if ending == rules.TAKEOFF else z.y
    answer[:8] = ending, t, z.x1, z.v1, z.v2, y, rules.gained(job, z), count


OFF = (0.0, 0.0, 0.0, 0.0, 1.0)
"""The row of an event function that is not active."""


def _first_of(search: Any, requests: Any, count: int) -> dict[int, tuple[float, int, Point]]:
    """The first event of each request: of those in a step diffrax takes the first in its list, so it is asked again."""
    matrix, functions = np.zeros((count, 4, 5)), np.tile(OFF, (count, 6, 1))
    z, limit, first = np.zeros((count, 4)), np.full(count, 1e-3), np.full(count, 1e-3)
    for n, (leg, side_1, side_2, state, longest) in requests.items():
        matrix[n], functions[n] = _matrix(leg, side_1, side_2)[:4], _functions(leg, side_1, side_2, state)
        z[n], limit[n] = state, longest
        first[n] = min(rules.first_step(leg, side_1, side_2, state), longest)
    best: dict[int, tuple[float, int, Point]] = {}
    open_ = set(requests)
    while open_:
        took, which, states = (np.asarray(each) for each in search(matrix, functions, z, limit, first))
        for n in list(open_):
            if which[n] != NONE or n not in best:
                _, side_1, side_2, state, _ = requests[n]
                x1, v1, v2, y = states[n].tolist()
                there = Point(x1 if side_1 else state.x1, v1 if side_1 else 0.0, v2 if side_2 else 0.0, y)
                best[n] = float(took[n]), int(which[n]), there
            values = functions[n] @ np.append(states[n], 1.0)
            if which[n] == NONE or not np.any(np.delete(values, which[n]) < 0.0):
                open_.remove(n)
                continue
            functions[n, which[n]] = OFF
            limit[n] = took[n]
            first[n] = min(first[n], took[n])
    return best


def solve(jobs: Jobs, tolerance: float):
    """All stances at a time; ImportError without diffrax."""
    search, found = _search(tolerance), answers(len(jobs))
    walks = [_walk(tuple(job), row) for job, row in zip(jobs.table.tolist(), found, strict=True)]
    asked = {n: walk.send(None) for n, walk in enumerate(walks)}
    while asked:
        going = {}
        for n, event in _first_of(search, asked, len(jobs)).items():
            try:
                going[n] = walks[n].send(event)
            except StopIteration:
                continue
        asked = going
    return found
