"""The structs of the C library's interface, each declared once: the header and its mirror in Python are made from here.

Records of the derivation (Robot, State, Ledger, ...) are structs of reals; those here have members of other types, or
hold other structs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from ..ir import Authored, Member, Quantity, Record, Struct
from .names import in_c
from .quantities import BODY_HEIGHT, CURRENT, ROBOT, STATE


def of_quantities(quantities: Iterable[Quantity], type_: str = "real") -> Iterator[Member]:
    """Members that are quantities of the derivation, or columns of them; where C spells the name of a file otherwise the
    meaning begins with the file's.
    """
    for quantity in quantities:
        name = member_name(quantity)
        meaning = quantity.meaning if name == quantity.name else f"{quantity.name}: {quantity.meaning}"
        yield Member(name, type_, meaning, quantity.unit)


def member_name(quantity: Quantity) -> str:
    """What C calls a quantity: what the derivation does, or the name of a file as C spells it."""
    return in_c(quantity.name) if isinstance(quantity, Authored) else quantity.name


def struct_of(record: Record) -> Struct:
    """A record of reals as a struct; C has none without a member."""
    members = tuple(of_quantities(record.quantities)) or (Member("nothing", "real", "the model has no entry; 0"),)
    return Struct(record.name, record.meaning, members)


SEARCH_CANDIDATES = 15
"""Currents that a search remembers: the ends of the intervals that wait."""

TIMESCALES = Struct("Timescales", "Of the poles of a mode.").of(
    Member("half_period", "real", "of the pair; HOPFORM_NEVER where its poles are real", "s"),
    Member("pole", "real", "the fastest real pole", "1/s"),
)
TRANSITION = Struct(
    "Transition",
    "Both masses slipping: what their rates and coordinates become from node to node.",
).of(
    Member("h", "real", "from node to node", "s"),
    Member("fastest", "real", "no pole is faster", "1/s"),
    Member("is_short_over", "real", "series are short over it; 0 where their terms would not be numbers", "s"),
    Member("apart", "real", "1 where the real pole is far beyond a pair that rings, else 0"),
    Member("above", "real", "the real pole beyond the rate of each mass alone", "1/s", count=2),
    Member("stays", "real", "of each rate, by rows, in SI units", count=9),
    Member("gains", "real", "what each coordinate gains, by rows, in SI units", count=9),
    Member("moves", "real", "what the position gains beyond v_1 h, in SI units", count=3),
)
PLAN = Struct(
    "Plan", "What is computed once per robot: coefficients of the equations of motion, poles of each mode, and a node."
)
STEP = Struct("Step", "A step of the input: u from time t on.").of(
    Member("t", "real", "", "s"), Member("u", "real", "", CURRENT.unit)
)
PHASE = Struct("Phase", "A phase: where and when it starts, and in which mode.").of(
    Member("t", "real", "time since the start", "s"),
    *of_quantities(STATE.quantities),
    Member(
        "mode", "int8", "3 (side_1 + 1) + side_2 + 1, side_i the sign of v_i, 0 if held; with a law side_2 is its limit"
    ),
    Member("event", "int8", "HOPFORM_EVENT_..., what started it; HOPFORM_IS_EVENT tells events"),
    Member("step", "uint16", "index of the step of the input"),
)
STANCE = Struct("Stance", "A stance, solved.").of(
    Member("duration", "real", "time of the ending", "s"),
    Member("end", "State", "state at the ending"),
    Member("apex", "real", "hop height of the apex; 0 without take-off", "m"),
    Member("aed", "real", "analytical energy delta: change of the body's energy", "J"),
    Member("start_loss", "real", "energy lost at a stop at t = 0, negative", "J"),
    Member("ending", "int32", "HOPFORM_ENDING_..."),
    Member("phase_count", "int32", "phases of the stance, kept or not"),
    Member("phases_kept", "int32", "phases in the caller's buffer"),
    Member("event_count", "int32", "events of the stance, kept or not"),
)
PLANT = Struct("Plant", "A motion that continues from tick to tick under an input that each tick sets.").of(
    Member("plan", "Plan"),
    Member("state", "State", "now"),
    Member("from_lower", "real", "position less its lower stop: more digits than the position has"),
    Member("from_upper", "real", "position less its upper stop"),
    Member("largest_y", "real", "largest magnitude of y where a phase has begun"),
    Member("rounding", "real", "what the acceleration is rounded by of what rests at a stop; else 0"),
    Member("fraction", "real", "time since it began, less whole seconds", "s"),
    Member("carry", "real", "what rounding has left of that: fraction + carry is the time", "s"),
    Member("seconds", "uint32", "whole seconds since it began", "s"),
    Member("mode", "int8", "as that of a phase"),
    Member("begins", "int8", "1 if its next tick is the first from its state: what happens there is no event"),
)
REPORT = Struct("Report", "What a tick of a plant did; `phases` and `capacity` are the caller's.").of(
    Member("start", "Start", "coordinates and velocities behind it, as the file of the model has them"),
    Member("duration", "real", "time that has passed: dt where the tick is over", "s"),
    Member("ending", "int32", "HOPFORM_ENDING_HORIZON or _REST where the tick is over; else what ended it before"),
    Member("count", "int32", "phases of the tick, kept or not"),
    Member("event_count", "int32", "events of the tick, kept or not"),
    Member("capacity", "int32", "phases that fit into the caller's memory"),
    Member("phases", "Phase *", "this memory, NULL for none; times count from where the tick begins"),
)
TARGET = Struct("Target", "What the controller is asked for.").of(
    Member("h_des", "real", "hop height of the next apex", "m"),
    Member("datum", "real", "the level that h_des counts from, less that of the ground under the foot", "m"),
    Member("stop_margin", "real", "x_1 stays below x1_max by more than this", "m"),
    Member("horizon", "real", "longest time of a stance", "s"),
    Member("max_evaluations", "int32", "in a candidate's stance, a phase is 4; 0 for HOPFORM_CANDIDATE_EVALUATIONS"),
    Member("max_candidates", "int32", "currents tried; 0 for HOPFORM_SEARCH_TRIALS"),
)
COMMAND = Struct("Command", "The answer of the controller.").of(
    Member("u", "real", "", "A"),
    Member("apex", "real", "hop height that follows, as h_des; 0 without take-off", "m"),
    Member("status", "int32", "HOPFORM_COMMAND_..."),
)
TRIAL = Struct("Trial", "A current that was tried, and what its stance does.").of(
    Member("u", "real", "", "A"),
    Member("apex", "real", "0 without take-off", "m"),
    Member("apex_u", "real", "its derivative by u, as the next ones", "m/A"),
    Member("largest_x1", "real", "largest x_1; where x1_max is hit, beyond it by how far the stance is from that", "m"),
    Member("largest_x1_u", "real", "", "m/A"),
    Member("least_contact", "real", "least minimum of the contact force over k; one behind the take-off is < 0", "m"),
    Member("least_contact_u", "real", "", "m/A"),
    Member("events", "uint32", "stands for the order of modes and events"),
    Member("minima", "uint8", "how many minima of it there are, up to 255"),
    Member("takes_off", "bool"),
    Member("held", "bool", "the actuator never moves"),
    Member("smooth", "bool", "the derivatives exist"),
)
SEARCH = Struct("Search", "A search for a current; the caller's memory.").of(
    Member("plan", "const Plan *"),
    Member("start", "State"),
    Member("apex", "real", "desired, over the ground", "m"),
    Member("limit", "real", "x_1 stays below", "m"),
    Member("horizon", "real", "", "s"),
    Member("datum", "real", "", "m"),
    Member("best_u", "real", "the nearest so far; 0 until one is admissible", "A"),
    Member("best_apex", "real", "over the ground", "m"),
    Member("next", "real", "what to try", "A"),
    Member("candidates", "Trial", "currents with an interval beside them, by u", count=SEARCH_CANDIDATES),
    Member(
        "lower_bound", "real", "of the gap to the next one; below 0 with a root in it", "m", count=SEARCH_CANDIDATES
    ),
    Member("slow", "int8", "candidates in a row that left most of the interval", count=SEARCH_CANDIDATES),
    Member("count", "int32", "of the candidates"),
    Member("sides", "int32", "of 0, yet to be opened: both 2, the upper one 1, the lower one -1"),
    Member("trials", "int32", "currents tried so far"),
    Member("max_evaluations", "int32", "of a stance"),
    Member("max_candidates", "int32"),
    Member("status", "int32", "HOPFORM_SEARCHING, HOPFORM_OK when done, or an error"),
    Member("held", "bool", "0 leaves the actuator where it is"),
    Member("found", "bool", "one is admissible"),
    Member("reached", "bool"),
    Member("partial", "bool", "a stance outgrew the memory given"),
    Member("capped", "bool", "a stance took more evaluations"),
)
FLIGHT_PHASE = Struct("FlightPhase", "A phase of a flight: where and when it starts, and in which mode.").of(
    Member("t", "real", "time since take-off", "s"),
    Member("x1", "real", "", "m"),
    Member("v1", "real", "", "m/s"),
    Member("acc1", "real", "", "m/s^2"),
    Member("side", "int8", "sign of v1, 0 if held"),
    Member("limit", "int8", "sign of the motor's pull gamma2 u at its limit, 0 under the law"),
    Member("event", "int8", "HOPFORM_EVENT_X1_..., HOPFORM_FLIGHT_EVENT_..., HOPFORM_EVENT_NONE: what started it"),
    Member("spare", "int8", "0"),
)
FLIGHT = Struct("Flight", "A flight, solved. In its states y is counted from the ground ahead.").of(
    Member("gains", "Gains", "of the law; 0 where the motor has no force"),
    Member("start", "State", "as given"),
    Member("ground", "real", "height of the ground ahead over that which was left", "m"),
    Member("duration", "real", "time of the ending", "s"),
    Member("end", "State", "state at the ending: before the impact"),
    Member("v2_after", "real", "velocity of the body after the impact", "m/s"),
    Member("apex", "real", "highest hop height of the body over the ground ahead, up to the ending", "m"),
    Member("apex_time", "real", "", "s"),
    Member("impact_loss", "real", "energy lost at the impact, negative", "J"),
    Member("start_loss", "real", "energy lost at a stop at t = 0, negative", "J"),
    Member("leg_loss", "real", "energy lost by a damper in the unloaded leg, negative", "J"),
    Member("ending", "int32", "HOPFORM_FLIGHT_..."),
    Member("phase_count", "int32", "phases of the flight, kept or not"),
    Member("phases_kept", "int32", "phases in the caller's buffer"),
    Member("event_count", "int32", "events of the flight, kept or not"),
    Member("designed", "int32", "1 if the gains are those of hopform_design_return, else 0"),
)
DETECTOR = Struct("Detector", "How touchdown is found in a noisy signal of contact.").of(
    Member("high", "real", "the signal is above where it reaches this"),
    Member("low", "real", "and no longer where it falls below this; low <= high"),
    Member("count", "int32", "samples in a row that must agree, >= 1"),
)
CONTACT = Struct("Contact", "What is known of the contact; begins as zeros.").of(
    Member("above", "int32", "1 if the signal is above"),
    Member("touches", "int32", "1 if the foot is taken to touch"),
    Member("run", "int32", "samples in a row that disagree with it"),
)
INPUT = Struct("Input", "A number per stance: each `stride` bytes behind the one before; 0 repeats a single one.").of(
    Member("first", "const void *"), Member("stride", "ptrdiff")
)
OUTPUT = Struct("Output", "A column that is written; `first` may be NULL where it is not wanted.").of(
    Member("first", "void *"), Member("stride", "ptrdiff")
)


def stances_in(robot: Record) -> Struct:
    """Where a batch reads, with a column for each parameter of the robot."""
    fields = len(robot.quantities)
    return Struct(
        "StancesIn", "Where robots, states at the start, inputs and longest times are read; what is asked."
    ).of(
        Member(
            "robot", "Input", "HOPFORM_ROBOT_FIELDS, in the order of the robot's members", count=fields, is_array=True
        ),
        *of_quantities((*STATE.quantities, CURRENT), "Input"),
        Member("horizon", "Input", "", "s"),
        Member("max_phases", "int32"),
        Member(
            "step_count", "int32", "steps of the input of each stance; 0 and 1 are one from 0 on without step_times"
        ),
        Member("step_stride", "ptrdiff", "bytes from the input of a step to that of the next one"),
        Member("step_times", "const real *", "when each begins, in all stances alike; NULL for one at 0", "s"),
        Member("times", "const real *", "of states and tangents, in all stances alike; in order for tangents", "s"),
        Member("columns", "const int32 *", "of derivatives; NULL for all of the model"),
        Member("time_count", "int32"),
        Member("column_count", "int32"),
    )


STANCES_OUT = Struct("StancesOut", "Where results and states at the ending go; NaN and a status < 0 where refused.").of(
    Member("status", "Output", "int32_t: HOPFORM_ENDING_..., or HOPFORM_ERROR_..."),
    Member("duration", "Output", "time of the ending", "s"),
    *of_quantities((*STATE.quantities[:2], BODY_HEIGHT, STATE.quantities[2]), "Output"),
    Member("apex", "Output", "hop height of the apex; NaN without take-off, and where g = 0", "m"),
    Member("aed", "Output", "analytical energy delta", "J"),
    Member("event_count", "Output", "int32_t"),
    Member("phases", "Phase *", "where one stance after the other is solved; NULL where nothing of it is read"),
    Member("phase_capacity", "int32"),
    Member("event_time", "real *", "event_capacity a stance, NaN behind its last; NULL if no events are wanted", "s"),
    Member("event_kind", "int8 *", "HOPFORM_EVENT_..., HOPFORM_EVENT_NONE behind its last"),
    Member("event_capacity", "int32"),
    Member("steps", "Step *", "where the steps of one stance after the other are put; NULL without step_times"),
    Member("states", "State *", "time_count a stance, NaN behind its ending; NULL if not wanted"),
    Member("sensitivities", "real *", "a matrix a stance, NaN where there is none; NULL if not wanted"),
    Member("tangents", "real *", "time_count matrices a stance, NaN behind its ending; NULL if not wanted"),
    Member("reading_status", "int32 *", "of what is read of each stance, and of its sensitivities; NULL if not wanted"),
    Member("tangent_status", "int32 *", "HOPFORM_NO_DERIVATIVE where one up to the times has none; NULL likewise"),
    Member("compressions", "real *", "the largest one of each stance; NULL if not wanted", "m"),
)


def flights_in(robot: Record) -> Struct:
    """Where a batch of flights reads."""
    members = {each.name: each for each in stances_in(robot).members}
    start, rest = (
        (members[name] for name in ("robot", *(each.name for each in STATE.quantities))),
        ("horizon", "max_phases"),
    )
    return Struct(
        "FlightsIn", "Where robots, states at take-off, grounds, gains and longest times are read; what is asked."
    ).of(
        *start,
        Member("ground", "Input", "height of the ground ahead over that which was left", "m"),
        Member("gains", "Input", "Kp, Kd; NULL, both, for those of hopform_design_return", count=2, is_array=True),
        *(members[name] for name in rest),
        Member("times", "const real *", "of states, in all flights alike; in order", "s"),
        Member("columns", "const int32 *", "of derivatives; NULL for all of a flight"),
        *(members[name] for name in ("time_count", "column_count")),
    )


FLIGHTS_OUT = Struct(
    "FlightsOut",
    "Where results of flights go: NaN and a status < 0 where refused. Phases are needed for the lists below.",
).of(
    Member("status", "Output", "int32_t: HOPFORM_FLIGHT_..., or HOPFORM_ERROR_..."),
    Member("duration", "Output", "time of the ending", "s"),
    *of_quantities((*STATE.quantities[:2], BODY_HEIGHT, STATE.quantities[2]), "Output"),
    Member("v2_after", "Output", "velocity of the body after the impact", "m/s"),
    Member("y", "Output", "compression of the leg at the ending, counted from the ground ahead", "m"),
    Member("apex", "Output", "highest hop height of the body over the ground ahead", "m"),
    Member("apex_time", "Output", "", "s"),
    Member("impact_loss", "Output", "energy lost at the impact, negative", "J"),
    Member("leg_loss", "Output", "energy lost by a damper in the leg, negative", "J"),
    Member("Kp", "Output", "of the law", "N/m"),
    Member("Kd", "Output", "", "N s/m"),
    Member("event_count", "Output", "int32_t"),
    Member("phases", "FlightPhase *", "where one flight after the other is solved; NULL where no list is wanted"),
    Member("phase_capacity", "int32"),
    Member("event_time", "real *", "event_capacity a flight, NaN behind its last; NULL if no events are wanted", "s"),
    Member("event_kind", "int8 *", "as in hopform_flight_phase, HOPFORM_EVENT_NONE behind its last"),
    Member("event_capacity", "int32"),
    Member("states", "State *", "time_count a flight, NaN behind its ending; NULL if not wanted"),
    Member("sensitivities", "real *", "a matrix a flight, NaN where there is none; NULL if not wanted"),
)


HOP_INPUT = Struct("HopInput", "A number per run and hop: `hop_stride` bytes lead to the next hop, 0 repeats one.").of(
    Member("first", "const void *"), Member("stride", "ptrdiff"), Member("hop_stride", "ptrdiff")
)
HOP_OUTPUT = Struct("HopOutput", "A table of runs and hops that is written; `first` may be NULL where unwanted.").of(
    Member("first", "void *"), Member("stride", "ptrdiff"), Member("hop_stride", "ptrdiff")
)
HOPS_OUT = Struct("HopsOut", "Where what runs of hops do goes; NaN and a status < 0 where refused.").of(
    Member("status", "Output", "int32_t: HOPFORM_RUN_..., or HOPFORM_ERROR_..."),
    Member("hops", "Output", "int32_t: stances solved"),
    Member("duration", "Output", "time of the ending", "s"),
    *of_quantities((*STATE.quantities[:2], BODY_HEIGHT, STATE.quantities[2]), "Output"),
    Member("y", "Output", "compression there; with the others the state from which a completed run flies on", "m"),
    Member("ending", "HopOutput", "int32_t: HOPFORM_ENDING_... of the stance; 0 without one"),
    Member("touchdown", "HopOutput", "time of the touchdown", "s"),
    *(Member(f"start_{each.name}", "HopOutput", "at the touchdown", each.unit) for each in STATE.quantities),
    Member("stance", "HopOutput", "how long the stance lasts", "s"),
    *(Member(f"end_{each.name}", "HopOutput", "at the ending of the stance", each.unit) for each in STATE.quantities),
    Member("apex", "HopOutput", "hop height of the apex over the ground under the foot; NaN without take-off", "m"),
    Member("aed", "HopOutput", "analytical energy delta of the stance", "J"),
)


def hops_in() -> Struct:
    """Where runs of hops are read, beside what a batch of stances is."""
    return Struct("HopsIn", "Where runs of hops are read: as of stances, and by hop.").of(
        Member("runs", "StancesIn", "robots, states at the start, input and longest time of every stance"),
        Member("u", "HopInput", "the input by hop, in place of that of `runs`; NULL for that", CURRENT.unit),
        Member("ground", "HopInput", "height of the ground ahead over that which is left; NULL where it is flat", "m"),
        Member("Kp", "Input", "of the law in flight; NULL for those of hopform_design_return", "N/m"),
        Member("Kd", "Input", "", "N s/m"),
        Member("hops", "int32", "stances of a run"),
        Member("from_touchdown", "int32", "1 where the states are those of the first touchdown, 0 in the air"),
    )


OF_CONTACT = (
    "Target", "Command", "Trial", "Search", "FlightPhase", "Flight", "Detector", "Contact", "FlightsOut", "HopInput",
    "HopOutput", "HopsOut",
)  # fmt: skip
"""Structs of models with a contact alone: of the controller, of flights, of hops and of touchdown's detection."""
ENDING_OF_CONTACT = ("apex", "aed", "compressions")
"""Members of what is solved that a contact brings."""


def plan_of(moving: tuple[int, ...] = (1, 2), *, has_law: bool = False) -> Struct:
    """The plan of a model: rates, and poles for each form of its modes; where two masses move the constants of a node."""
    alone = [f"mass {n} slips alone" for n in moving]
    forms = [
        *(["both masses slip"] if len(moving) == 2 else []),
        *alone,
        *(["the same under the law"] if has_law else []),
    ]
    rates = ["of the equations of motion", *(["under the law"] if has_law else [])]
    return PLAN.of(
        Member("robot", "Robot"),
        Member("rates", "Rates", "; ".join(rates), count=len(rates), is_array=True),
        Member("poles", "Poles", "; ".join(forms), count=len(forms), is_array=True),
        Member("timescales", "Timescales", "of each", count=len(forms), is_array=True),
        *((Member("transition", "Transition"),) if len(moving) == 2 else ()),
        Member("made", "uint32", "HOPFORM_PLAN_MADE once hopform_plan_init was content"),
    )


def structs(
    robot: Record = ROBOT,
    moving: tuple[int, ...] = (1, 2),
    *,
    has_law: bool = False,
    has_contact: bool = True,
) -> tuple[Struct, ...]:
    """The structs of the interface that are no records, each behind those that it holds: what a model has."""
    declared = [value for value in globals().values() if isinstance(value, Struct)]
    of_model = {PLAN.name: plan_of(moving, has_law=has_law)}
    if len(moving) < 2:
        declared.remove(TRANSITION)
    if not has_contact:
        declared = [each for each in declared if each.name not in OF_CONTACT]
        of_model |= {
            each.name: replace(
                each, members=tuple(member for member in each.members if member.name not in ENDING_OF_CONTACT)
            )
            for each in (STANCE, STANCES_OUT)
        }
    of_contact = (flights_in(robot), hops_in()) if has_contact else ()
    return (*(of_model.get(each.name, each) for each in declared), stances_in(robot), *of_contact)
