"""Forms whose pairs are those of the reference configuration."""
