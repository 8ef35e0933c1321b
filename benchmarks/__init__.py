"""Long measurements: accuracy of the screening, speed against the textbook method and against peers."""

import os

# One thread for everything that is timed; numpy reads it when it is first imported.
os.environ["OMP_NUM_THREADS"] = "1"
