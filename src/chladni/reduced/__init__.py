"""Reduced model of a structure and its derivatives by the parameters."""
