"""How a body becomes equations of motion: systems, as integrators see them."""
