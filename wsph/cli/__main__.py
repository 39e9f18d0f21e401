"""`python -m wsph.cli`, where the script is not on the path."""

# pyright: strict

import sys

from wsph.cli.entry import main

sys.exit(main())
