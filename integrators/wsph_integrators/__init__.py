"""wsph's integrators: plugins like anyone's."""
