"""Probes: what is recorded of bodies at points, and of what reports."""
