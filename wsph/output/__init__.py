"""What a run leaves: fields by name, files, formats, pictures."""
