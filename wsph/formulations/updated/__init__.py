"""The form whose pairs follow the motion."""
