"""A run: composed, stepped, checked, recorded, summed up."""
