"""What can be wrong with a request about a job; `service.rest.errors` says with which HTTP status."""

from __future__ import annotations

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


class NoSuchUpload(InvalidInput):
    """There is no upload of this identifier."""


class UploadTooLarge(InvalidInput):
    """The file is larger than the service takes."""


class DamagedUpload(InvalidInput):
    """The file is not what its type says."""


class NoRoom(InvalidInput):
    """The disk is full, or about to be."""
