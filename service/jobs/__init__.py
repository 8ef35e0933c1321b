"""Jobs that outlive the process: accepted means on disk, killed means gone on with.

`jobs.py` is the front door. A job is a row (`service.records.jobs`), a folder of files (`job_folder.py`) and
a place in a durable queue (`durable_queue.py`); what it does is its kind's (`screening/`, `training/`).
"""
