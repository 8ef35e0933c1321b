"""Nastran: OUTPUT4 matrices, and matrices, nodes and coordinate systems in bulk data."""
