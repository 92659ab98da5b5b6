"""Sensor layouts: information, deletion, exchange, searches, rules."""
