"""What random numbers of this room are drawn for."""

from enum import IntEnum


class Role(IntEnum):
    """The number is part of a stream's key: a released role keeps its own, and no two rooms have one."""

    UNIFORM_TERRAIN = 0
    GAUSSIAN_TERRAIN = 1
    TOUCHDOWN_SENSORS = 2
    TICK_SENSORS = 3
    DETECTOR_DELAYS = 5
