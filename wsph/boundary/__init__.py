"""Prescribed values and loads: selections, values on the device, conditions of each kind of formulation, their work."""
