"""What a file of blades holds, looked at when it has come: a slip is told then, and not with the order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint
from service.jobs.screening.checks import checked_document
from service.settings import Settings

# Whether a blade file can be used takes 0.9 ms, six times as long as parsing it (rotor 37 at three speeds): a
# file of 5,000 takes 3 s in all this way. The order looks at every one again.
CLOSELY = 1000


@dataclass(frozen=True)
class Contents:
    """What is in a file of blades.

    Attributes
    ----------
    blades
        Blade files and profiles, the faulty ones among them.
    fault
        The first that cannot be used, among the first `CLOSELY`; None where all of these can.
    """

    blades: int
    fault: InvalidInput | None


def contents(name: str, documents: Iterable[tuple[str, Any]], limits: Settings) -> Contents:
    """Look through a file: every document is read, and the first ones are looked at closely.

    A blade that cannot be used is no reason to refuse the file: an order may skip it (`bad_blades`).

    Parameters
    ----------
    name
        The file's, for errors.
    documents
        (source, parsed JSON) of each; raises where it cannot be read.

    Raises
    ------
    InvalidInput
        Where there is none, and as `documents`.
    """
    count, fault = 0, None
    for source, document in documents:
        checkpoint()
        count += 1
        if fault is None and count <= CLOSELY:
            try:
                checked_document(document, limits)
            except InvalidInput as error:
                fault = error.under(source)
    if not count:
        raise InvalidInput(name, "no blade in it", "send at least one blade file or profile")
    return Contents(count, fault)
