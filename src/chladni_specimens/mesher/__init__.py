"""Quad-dominant meshes of pressed sheets."""
