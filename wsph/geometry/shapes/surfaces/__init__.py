"""Surfaces of shapes: smooth heights that go on past their borders, nearest points and areas."""
