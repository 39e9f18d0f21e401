"""`wsph calibrate`: parameters of a scene fitted to measured curves, with what data and mesh leave open of them."""
