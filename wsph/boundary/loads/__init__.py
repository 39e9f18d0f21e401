"""Loads on faces: prescribed ones as rows that add up, and those that follow the state of a body."""
