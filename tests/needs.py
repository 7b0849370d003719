"""What some tests need and a bare machine may lack. A skipped test prints why; in CI it fails."""

import pytest

import hopform

MESSAGE = hopform.library_message()
library = pytest.mark.skipif(
    MESSAGE is not None,
    reason=f"the C back end is absent, and NumPy cannot be compared with it: {MESSAGE} (`make test` builds it)",
)
