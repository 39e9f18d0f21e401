"""How a run begins: relaxation to rest, and what bodies start with."""
