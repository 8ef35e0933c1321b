"""Classes of contact: a surrogate is certified for each on its own."""

from __future__ import annotations

from sdm_core.contact import ContactConfiguration

PERMANENT, ARCS, SMOOTH = "permanent", "arcs", "smooth"
_WORDS = {PERMANENT: "permanent contact", ARCS: "arcs of contact", SMOOTH: "smooth engagement"}


def contact_class(contact: ContactConfiguration) -> str:
    """`PERMANENT`, `ARCS` or `SMOOTH`."""
    if contact.permanent:
        return PERMANENT
    return SMOOTH if contact.smooth else ARCS


def in_words(name: str) -> str:
    """A class of contact for people.

    Examples
    --------
    >>> in_words(ARCS)
    'arcs of contact'
    """
    return _WORDS.get(name, name)
