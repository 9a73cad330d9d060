"""Accuracy against time on a user's own scene: ``mpad cost``."""
