"""Taylor-SPH: two sets of particles, in small strain and in the current configuration."""
