"""Phase-field fracture: the field, the split of the energy, the response of a point."""
