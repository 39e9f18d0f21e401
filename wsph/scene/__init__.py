"""The input: tables of a scene, checks, messages."""
