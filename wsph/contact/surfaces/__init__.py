"""Surfaces of bodies: what contact, tools and ties act on."""
