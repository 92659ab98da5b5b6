"""Likelihood, model-form error, fits and their evidence, test of fit."""
