"""Studies: a scene under a grid of overrides, one row of cost and error each, and the front that they make."""
