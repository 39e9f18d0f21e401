"""Contact of bodies whose particles are balls."""
