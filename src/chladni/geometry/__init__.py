"""Points on shells: nearest ones, edges, curvature, clearance, mapped thickness."""
