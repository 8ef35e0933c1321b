"""Exact stability of a rubbing blade: modal data and contact to delay equation to verdict."""
