"""Setting up: what bodies share, their systems, bodies that step together."""
