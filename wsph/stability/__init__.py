"""Limits of the time step: spectra of a body's small motions, growth of a step, the guard."""
