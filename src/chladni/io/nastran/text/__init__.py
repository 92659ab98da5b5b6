"""A deck as text: its files, lines, cards and fields, read without loss."""
