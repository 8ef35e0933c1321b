"""Surrogate of the exact core: sampling, labels, features, classifier, calibration, policy."""
