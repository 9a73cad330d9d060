"""Surfaces and the contact between them; one module a part."""
