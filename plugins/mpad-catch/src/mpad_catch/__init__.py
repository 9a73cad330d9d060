"""Bonds that hold longer under some force than under none; one module a law."""
