"""Tables of what bodies touch: contacts between them, and rigid tools."""
