"""Confident answers of the surrogate, held to the exact core while the service runs."""
