"""The independent witness: motion integrated in time, sharing nothing with the stability solvers."""
