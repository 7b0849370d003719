"""`python -m hopform`: the command line."""

import sys

from hopform._cli import main

if __name__ == "__main__":
    sys.exit(main())
