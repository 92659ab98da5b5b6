"""Mesh tooling: decks, thickness mapping, curvature, quality."""
