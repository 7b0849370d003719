"""`python -m hopform`: the command line."""

import sys

from hopform._front import main

if __name__ == "__main__":
    sys.exit(main())
