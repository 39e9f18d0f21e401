"""`wsph calibrate`: parameters of a scene fitted to measured curves, with what the data and what the mesh leave open of them."""
