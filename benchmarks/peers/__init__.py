"""rubscreen beside the dense textbook method, tdcpy and jitcdde, in one process and one thread."""
