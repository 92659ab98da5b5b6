"""The decision of a diagnosis: from rows of numbers to a verdict with reasons, without any fit."""
