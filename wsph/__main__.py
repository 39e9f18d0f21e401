"""`python -m wsph`, where the script is not on the path."""

# pyright: strict

import sys

from wsph.cli import main

# Workers of an executor read this module too.
if __name__ == "__main__":
    sys.exit(main())
