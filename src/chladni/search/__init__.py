"""Preparation of a question, search for hypotheses, the answer and its words."""
