"""The oracle of mechanisms with dry friction: 60 digits from the equations of motion and the rules of events.

    M q'' = -K q - B q' + f + g u - sum_e c_e F_e(c_e . q') + constraint forces of what is held

It is written from physics and shares nothing with what it judges: the standard library and mpmath alone. A problem is
one JSON object (fixtures/*.json). Entries of matrices and rows are numbers or formulas in the names of `parameters` and
`start` (+ - * / **, sqrt, max, min, abs, ulp of a float64). Numbers are decimals, fractions, hex floats or floats, all
taken exactly.

| field | meaning | unit |
|---|---|---|
| `parameters`, `start` | inputs by name; their rounding is what conditions and neighbours are about | SI, as declared |
| `coordinates` | names of the entries of q | m, or rad |
| `position`, `velocity` | q and q' at t = 0 | m, m/s |
| `mass` | M, symmetric, positive | kg, or kg m^2 |
| `stiffness`, `damping` | K (symmetric), B: a matrix, or matrices by name, which add up | N/m, N s/m |
| `force` | f: a column, or columns by name | N |
| `input` | g, the force per unit of u | N/A |
| `u` | a number, or steps [[t0, u0], ...] from t0 = 0 | A |
| `elements` | `name`, `direction` c_e, `friction`, `at_rest` [F_plus, F_minus], `limits` [low, high] of q | -, N, m |
| `contact` | `force` N and `compression` y as rows, `tolerance` of y; the motion ends at N = 0 (takeoff) | N, m, m |
| `clearance` | a row; once positive, the motion ends where it falls through zero (touchdown) | m |
| `law` | a row, `target` and `limit`: the input is sat(row + target u), without `target` sat(row) | A |
| `outputs` | rows that `at(t)` and `final` return; with all names of `start`, for conditions | |
| `energies` | `mass`, `stiffness`, `force` of v M v/2 + q K q/2 - f q | J |
| `units` | scales of errors: `time` (at least the duration), each output, each energy | |
| `tied` | groups of inputs that are moved together where they are equal: a start at a stop stays there | |
| `answer` | in fixtures: what the motion is, to 30 digits | |
| `horizon`, `max_phases` | where the motion is given up | s, - |

A row is {"q": [...], "v": [...], "constant": ...}: q . position + v . velocity + constant.

A held element stays while -F_minus <= force <= F_plus, those at rest, the first non-zero derivative
decides at exact equality; limits are inelastic, the velocity is projected along M^-1 c onto all that are violated;
events are `<element>_reverses`, `_sticks`, `_slips`, `_hits_stop`; endings takeoff, touchdown, rest, horizon, tripped
(the foot never was over the ground), too_many_phases.
"""

from .chain import Event, Phase
from .equations import Problem, System, read
from .solution import Solution, solve

__all__ = ["Event", "Phase", "Problem", "Solution", "System", "read", "solve"]
