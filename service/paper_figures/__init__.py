"""The figures of [SBL] sections 4 and 5 drawn for other blades, each with what agrees and what does not."""
