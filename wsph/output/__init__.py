"""Output of a run: fields by name, files, formats, pictures."""
