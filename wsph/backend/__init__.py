"""Everything that runs on a device: types, states, launches, graphs, threads. No mechanics."""
