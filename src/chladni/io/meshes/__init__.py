"""Meshes and models of other programs."""
