"""What is taken for a limit of the time step."""

SLACK = 1e-6
"""A Courant number beyond its limit by less than this part of it is within."""
