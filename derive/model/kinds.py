"""The words for events, endings and statuses, and their numbers in the C library."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Word:
    """A word, its number in the C library, and what it means."""

    number: int
    text: str
    meaning: str
    of_contact: bool = False
    of_law: bool = False


@dataclass(frozen=True)
class Kind:
    """Words of one kind: their meaning, their type and the name of their table in Python, the prefix of their macros
    in C. Words and kinds `of_contact` or `of_law` are those of models with one alone.
    """

    meaning: str
    type: str
    table: str
    macro: str
    words: tuple[Word, ...] = ()
    of_contact: bool = False

    def of(self, *words: Word) -> "Kind":
        """The kind with these words."""
        return replace(self, words=words)

    def macro_of(self, word: Word) -> str:
        """Its name in C, behind the prefix of every public name."""
        return f"{self.macro}{word.text}".upper()


STATUSES = Kind("Status: 0 ok, negative an error, positive an answer with a warning.", "Status", "STATUSES", "").of(
    Word(0, "ok", "the answer, without a warning"),
    Word(1, "phases_not_kept", "the phase buffer was too small; everything else is exact"),
    Word(2, "no_derivative", "an event grazes, the ending has no derivative, or one is out of range"),
    Word(3, "searching", "the search for a current goes on", of_contact=True),
    Word(4, "ill_conditioned", "the actuator is too stiff for the precision: events of its creep may be wrong"),
    Word(5, "capped", "a cap on the search for a current was met: the best one within it", of_contact=True),
    Word(-1, "error_null", "a pointer is NULL"),
    Word(-2, "error_robot", "a parameter of the robot is out of its domain, or the plan was not made"),
    Word(-3, "error_state", "a state is not finite, a position is beyond a stop, or what is fixed moves"),
    Word(-4, "error_extended", "the leg is extended at the start, its compression negative", of_contact=True),
    Word(-5, "error_steps", "the steps of the input are none or too many, do not start at 0 or do not increase"),
    Word(-6, "error_horizon", "horizon or max_phases is not positive"),
    Word(-7, "error_time", "a time is not finite or outside the stance"),
    Word(-8, "error_numbers", "out of the range of the precision: scale the robot or use double precision"),
    Word(
        -9,
        "error_target",
        "the desired apex is below the ground, not finite, or stop_margin or a cap is negative",
        of_contact=True,
    ),
    Word(-10, "error_gains", "a gain is negative or not finite", of_contact=True),
    Word(-11, "error_detector", "a sample or threshold is not finite, low > high, or count < 1", of_contact=True),
    Word(-12, "error_unstable", "unstable robot: Routh's conditions p_i, q_i, s_i >= 0, s_1 s_2 >= s_3 are violated"),
    Word(-13, "error_overlap", "an output overlaps an input other than a small one"),
    Word(-14, "error_columns", "a column of derivatives is none, or their count is negative"),
)
COMMANDS = Kind("What the controller found.", "CommandStatus", "COMMANDS", "command_", of_contact=True).of(
    Word(1, "reached", "the next apex is the desired one"),
    Word(2, "nearest", "no admissible current reaches it; this one comes nearest"),
    Word(3, "no_takeoff", "no current is admissible"),
)
ENDINGS = Kind("How a stance ended.", "Ending", "ENDINGS", "ending_").of(
    Word(1, "takeoff", "the contact force returned to zero with the leg extending", of_contact=True),
    Word(2, "rest", "every mass is held, and nothing changes any more"),
    Word(3, "horizon", "the time limit, horizon, was reached"),
    Word(4, "too_many_phases", "the limit of phases was reached"),
    Word(5, "uncertified", "the search met its bound: the motion is certified up to here"),
)
EVENTS = Kind("What starts a phase: the events of a stance.", "EventKind", "EVENTS", "event_").of(
    Word(1, "x1_reverses", "the actuator reverses"),
    Word(2, "x1_sticks", "the actuator comes to rest"),
    Word(3, "x1_slips", "the actuator starts to move, or leaves a stop"),
    Word(4, "x1_hits_stop", "the actuator meets a stop"),
    Word(5, "x2_reverses", "the body reverses"),
    Word(6, "x2_sticks", "the body comes to rest"),
    Word(7, "x2_slips", "the body starts to move"),
)
SATURATES = Word(8, "u_saturates", "the input of a law reaches its limit", of_law=True)
DESATURATES = Word(9, "u_desaturates", "the input of a law leaves its limit", of_law=True)
BEGINNINGS = Kind("What starts a phase and is no event of a stance.", "Beginning", "BEGINNINGS", "event_").of(
    Word(0, "none", "the start, or a velocity or a stop that is touched"),
    SATURATES,
    DESATURATES,
    Word(10, "step", "a step of the input"),
)
FLIGHT_ENDINGS = Kind("How a flight ended.", "FlightEnding", "FLIGHT_ENDINGS", "flight_", of_contact=True).of(
    Word(1, "touchdown", "the foot has met the ground from above"),
    Word(2, "tripped", "the foot never got above the ground ahead"),
    Word(3, "horizon", "the time limit, horizon, was reached"),
    Word(4, "too_many_phases", "the limit of phases was reached"),
)
RUN_ENDINGS = Kind("How a run of hops ended.", "RunEnding", "RUN_ENDINGS", "run_", of_contact=True).of(
    Word(1, "completed", "all of its hops are solved"),
    Word(2, "stopped", "a stance ended without take-off, or a flight met a cap"),
    Word(3, "tripped", "the foot never got above the ground ahead"),
)
CURRENT_EVENTS = Kind(
    "What starts a phase of a flight beside the actuator: events there.",
    "CurrentEventKind",
    "CURRENT_EVENTS",
    "flight_event_",
    of_contact=True,
).of(
    Word(8, "u_saturates", "the current reaches its limit"),
    Word(9, "u_desaturates", "the current leaves its limit"),
)
CONTACTS = Kind(
    "What touchdown detection returns for a sample.", "Contact", "CONTACTS", "contact_", of_contact=True
).of(
    Word(1, "touchdown", "the foot touches"),
    Word(2, "takeoff", "the foot has left the ground"),
)
KINDS = (STATUSES, COMMANDS, ENDINGS, EVENTS, BEGINNINGS, FLIGHT_ENDINGS, RUN_ENDINGS, CURRENT_EVENTS, CONTACTS)
FLIGHT_EVENTS = (*(word for word in EVENTS.words if word.text.startswith("x1_")), *CURRENT_EVENTS.words)
"""Events that start a phase of a flight."""
LAST_EVENT = max(word.number for word in EVENTS.words)
"""What starts a phase is an event of a stance where its number is 1 up to this."""


def refusals() -> list[Word]:
    """Statuses that are errors."""
    return [word for word in STATUSES.words if word.number < 0]


TICK_PHASES = 4096
"""Phases of a tick of a plant at most."""

MOST_STEPS = 2**16 - 1
"""Steps of the current at most: a phase stores the index of its step in 16 bits."""

LONGEST_PREFIX = 31
"""Characters of a prefix of every public name: as many as C99 tells names of other files apart by."""
