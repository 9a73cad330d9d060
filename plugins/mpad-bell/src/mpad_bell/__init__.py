"""Bonds on a linear spring, each with one rate of breaking; one module a law."""
