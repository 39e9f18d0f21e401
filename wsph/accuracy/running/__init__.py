"""Where the rows of a search are run: in this process, in those that share a scene, or on the workers of an executor."""
