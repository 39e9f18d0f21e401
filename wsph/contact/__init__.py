"""Contact between bodies, and of a body with itself."""
