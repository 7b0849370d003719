"""What a user edits: the quantities, the equations of motion, and the words for what happens.

A model file takes from here `Quantity`, `Term` and the symbols of the robot and its state.
"""

from ..ir import Quantity as Quantity
from .equations import Model as Model
from .equations import ModelError as ModelError
from .equations import Term as Term
from .quantities import *
