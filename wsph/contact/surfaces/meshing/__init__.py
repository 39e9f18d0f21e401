"""The surface of a body on the host: its boundary, its mesh on the shape, and how that follows the particles."""
