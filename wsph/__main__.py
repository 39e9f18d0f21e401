"""`python -m wsph`, where the script is not on the path."""

# pyright: strict

import sys

from wsph.cli import main

sys.exit(main())
