"""What can be wrong with a request about a job; `service.rest.errors` says with which HTTP status."""

from __future__ import annotations

from typing import Any

from sdm_core.errors import InvalidInput


class NoSuchJob(InvalidInput):
    """There is no job of this identifier."""


class OtherRequest(InvalidInput):
    """The idempotency key was used with another request."""


class UnderWay(InvalidInput):
    """The job is not over."""


class NotScreened(InvalidInput):
    """There is no result of this blade, or not yet."""


class NotTrained(InvalidInput):
    """The training has no model, or not yet."""


class NotSimulated(InvalidInput):
    """There is no such result of the simulation, or not yet."""


class TooLargeForWorker(InvalidInput):
    """A part of a job ends every worker that computes it."""


class NoSuchUpload(InvalidInput):
    """There is no upload of this identifier."""


class UploadTooLarge(InvalidInput):
    """The file is larger than the service takes."""


class TooManyUploads(InvalidInput):
    """The files of the caller take up as much as they may.

    Attributes
    ----------
    members
        Of the problem document: the largest of them (`uploads`: id, name and size_bytes).
    """

    def __init__(self, field: str, value: Any, remedy: str, uploads: list[dict[str, Any]]) -> None:
        super().__init__(field, value, remedy)
        self.members = {"uploads": uploads}


class DamagedUpload(InvalidInput):
    """The file is not what its type says."""


class NoRoom(InvalidInput):
    """The disk is full, or about to be."""
