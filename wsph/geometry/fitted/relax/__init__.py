"""Nodes moved to where the cells are best: to the mean of their neighbours, then to where cells are most like cubes."""
