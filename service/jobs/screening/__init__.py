"""Batch screening as a job: a request becomes chunks of blades, chunks files, and files a ranking."""
