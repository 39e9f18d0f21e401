"""What the author of a scene says: tables, checks, messages."""
