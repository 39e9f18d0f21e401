"""What there is to name in a scene: lists, descriptions, JSON schemas, starting points and references, from declarations."""
