"""Concealed effects: cases made, diagnosed blindly, scored."""
