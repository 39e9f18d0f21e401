"""The table of loads that follow the state."""

# pyright: strict

from wsph.boundary.loads.acting import Load
from wsph.boundary.loads.pressure import Pressure
from wsph.boundary.loads.quiet import Quiet
from wsph.boundary.loads.spring import Spring

LOADS: dict[str, type[Load]] = {load.key: load for load in (Pressure, Spring, Quiet)}
"""Every load that follows the state, by its key: one is added by its file and an entry here."""
