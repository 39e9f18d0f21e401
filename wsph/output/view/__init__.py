"""Pictures of a run, off-screen (the extra "view"): bodies by VTK, what stands around them by matplotlib."""
