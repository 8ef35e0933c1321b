"""What a caller of the service may do: read, submit, admin, each with all that the ones before it may."""

from __future__ import annotations

from enum import StrEnum


class Role(StrEnum):
    """What a caller may do.

    Examples
    --------
    >>> Role.admin.covers(Role.submit), Role.read.covers(Role.submit)
    (True, False)
    """

    read = "read"
    """Ask questions, and look at models, jobs and results."""
    submit = "submit"
    """Also start and cancel jobs, and upload files."""
    admin = "admin"
    """Also exchange models."""

    def covers(self, needed: Role) -> bool:
        """Whether who has this role may do what `needed` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)
