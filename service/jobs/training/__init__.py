"""Retraining as a job: a process of its own, whose labels outlive it."""
