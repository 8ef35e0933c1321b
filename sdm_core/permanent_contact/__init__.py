"""Permanent contact: the boundary in closed form and the count of unstable roots."""
