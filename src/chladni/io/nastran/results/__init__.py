"""Punch and OP2 files."""
