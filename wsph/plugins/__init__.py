"""Third parties' materials and integrators: found, built from a scene's keys, blamed by name."""
