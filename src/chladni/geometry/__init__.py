"""Geometry of shells: nearest points, edges, curvature, clearance and mapped thickness."""
