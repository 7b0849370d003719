"""What a user edits: the elements of a model file, and how they become equations of motion; the words for what happens.

A model file takes from here what `declare` has.
"""

from .declare import *
from .declare import __all__ as __all__
from .equations import Model as Model
from .equations import ModelError as ModelError
