"""Blades and contacts screened over their operating range: lobes found, ranked, drawn."""
