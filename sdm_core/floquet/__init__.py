"""Floquet multipliers as zeros of det(I − M(μ)/μ): arcs of contact, smooth engagement, permanent contact."""
