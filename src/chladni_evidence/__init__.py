"""Blind evidence: make cases with concealed effects, diagnose them blindly, score them."""
