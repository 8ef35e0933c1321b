"""Simulations of a rubbed liner as they are ordered, run, kept and drawn."""
