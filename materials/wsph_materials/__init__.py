"""wsph's materials: plugins like anyone's. They import Warp and the standard library only."""
