"""Joint builders on any assembly."""
