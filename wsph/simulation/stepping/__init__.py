"""Runs that Python steps: their states between steps, and what is called when."""
