"""Optional parts of a body, one a file."""
