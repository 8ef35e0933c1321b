"""The endpoints: each thin, over functions that know no web framework."""
