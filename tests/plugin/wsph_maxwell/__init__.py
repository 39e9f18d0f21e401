"""A third party's plugins for wsph: a material and an integrator that the core never names."""
