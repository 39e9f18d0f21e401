"""A body whose pairs follow the motion, among processes: what each holds, works on and owns."""
