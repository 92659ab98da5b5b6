"""The open tailgate."""
