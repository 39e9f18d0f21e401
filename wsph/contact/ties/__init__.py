"""Ties: surfaces that are glued together."""
