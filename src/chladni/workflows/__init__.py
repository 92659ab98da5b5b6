"""The functions of chladni, one for each command: from a case to a result."""
