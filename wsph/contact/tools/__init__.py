"""Rigid tools: prescribed or free bodies that do not deform, and their contact with those that do."""
