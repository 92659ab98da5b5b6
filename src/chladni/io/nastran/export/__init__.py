"""A whole deck from an assembly."""
