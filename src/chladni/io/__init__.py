"""Files in and out: one format a room or a file."""
