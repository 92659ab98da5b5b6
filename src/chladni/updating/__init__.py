"""Finite element model updating: calibration, evidence, diagnosis."""
