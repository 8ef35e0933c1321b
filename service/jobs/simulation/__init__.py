"""Simulation jobs: many rotor speeds of a rubbed liner, a few of them stored at a time."""
