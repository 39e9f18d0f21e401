"""Bodies with fitted surfaces: cells of a grid that lie well inside, and a layer of cells from there to the exact surface.

`fit` has the steps in order, one file each. All is done in the frame of the shape before its own rotation, in metres.
"""
