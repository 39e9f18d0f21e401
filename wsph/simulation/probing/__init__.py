"""What probes record: fields at material points, and numbers of what the scene names."""
