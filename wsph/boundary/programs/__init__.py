"""Prescribed values as a scene writes them, and as programs on the device."""
