"""A screening as it is ordered: blades in the body while they are few, and sent ahead when they are many."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, cast

import orjson

from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from service.client.job_conversations import SCREENINGS, status_of
from service.client.job_status import JobStatus
from service.client.message import Conversation, Message, once
from service.client.problem import ServiceProblem
from service.client.uploading import LINES, BladeLike, Entry, entry_of, send
from service.jobs.screening.request import Criteria
from service.rest import replies
from service.rest.job_schemas import UploadReply

Json = dict[str, Any]
Contacts = Mapping[str, ContactConfiguration] | Sequence[ContactConfiguration | Mapping[str, Any]]
# The service takes bodies of 16 MiB unless it is told otherwise, and proxies often less.
INLINE_BYTES = 2 * 2**20
# Of one upload: small enough to be held and sent again, far below what the service takes.
PIECE_BYTES = 64 * 2**20
_OF_ORDER = re.compile(r"blades\[(?P<entry>\d+)\]")
_FOR = re.compile(r"for (?P<source>\S+): ")
_OF_PIECE = re.compile(r"blades(?:-(?P<first>\d+))?\.ndjson:(?P<line>\d+)")


def rest_of(
    contacts: Contacts | None,
    speed_range_hz: Sequence[float] | None,
    speed_range_ratio: Sequence[float] | None,
    criteria: Criteria | Mapping[str, float | None] | None,
    **plain: Any,
) -> Json:
    """The question without its blades; what is None is left out, and the service's own then.

    Raises
    ------
    InvalidInput
        For contacts that are none.
    """
    said = dict(plain)
    if contacts is not None:
        said["contacts"] = _contacts(contacts)
    for name, ends in (("speed_range_hz", speed_range_hz), ("speed_range_ratio", speed_range_ratio)):
        said[name] = None if ends is None else [float(end) for end in ends]
    said["criteria"] = criteria.to_dict() if isinstance(criteria, Criteria) else criteria
    said["map_shape"] = None if said.get("map_shape") is None else [int(n) for n in said["map_shape"]]
    return {name: value for name, value in said.items() if value is not None}


def submitted(
    blades: Iterable[BladeLike] | BladeLike, rest: Json, key: str | None
) -> Conversation[JobStatus]:
    """``POST /v1/screenings``, once for a key however often it is sent.

    Parameters
    ----------
    blades
        Taken one after the other: they may be made on the way.
    key
        Idempotency-Key; None makes one.

    Raises
    ------
    ServiceProblem
        With the place in `blades` of what was refused, whichever way it went.
    """
    headers = once(key)
    coming = _entries(blades)
    held, size = [], 0
    for entry in coming:
        held.append(entry)
        size += len(entry.content)
        if size > INLINE_BYTES:
            break
    if size <= INLINE_BYTES:
        try:
            return (yield from status_of(_order(held, rest, headers)))
        except ServiceProblem as problem:
            if not _body_too_long(problem) or not any(entry.document for entry in held):
                raise
    ahead: list[tuple[int, Entry]] = []
    piece: list[Entry] = []
    place, piece_size = 0, 0
    for entry in chain(held, coming):
        if piece and (not entry.document or piece_size + len(entry.content) > PIECE_BYTES):
            ahead.append((place - len(piece), (yield from _sent_ahead(piece, place - len(piece)))))
            piece, piece_size = [], 0
        if entry.document:
            piece.append(entry)
            piece_size += len(entry.content)
        else:
            ahead.append((place, entry))
        place += 1
    if piece:
        ahead.append((place - len(piece), (yield from _sent_ahead(piece, place - len(piece)))))
    try:
        return (yield from status_of(_order([entry for _, entry in ahead], rest, headers)))
    except ServiceProblem as problem:
        raise _placed(problem, [first for first, _ in ahead]) from None


def _entries(blades: Iterable[BladeLike] | BladeLike) -> Iterator[Entry]:
    # A document can be iterated over, and so can an upload's reply.
    alone = isinstance(blades, str | Mapping | UploadReply) or not isinstance(blades, Iterable)
    every = cast(Iterable[BladeLike], (blades,) if alone else blades)
    for place, blade in enumerate(every):
        yield entry_of(blade, place)


def _contacts(contacts: Contacts) -> list[Json]:
    if isinstance(contacts, Mapping):
        return [{"name": name, **contact.to_dict()} for name, contact in contacts.items()]
    found: list[Json] = []
    for i, contact in enumerate(contacts):
        if isinstance(contact, ContactConfiguration):
            found.append(contact.to_dict())
        elif isinstance(contact, Mapping):
            found.append(dict(contact))
        else:
            remedy = "give contacts by name, or a list of ContactConfiguration or documents"
            raise InvalidInput(f"contacts[{i}]", type(contact).__name__, remedy)
    return found


def _order(entries: list[Entry], rest: Json, headers: Mapping[str, str]) -> Message:
    # As they were written: decoding them only to encode them again would take as long as all the rest.
    blades = [orjson.Fragment(entry.content) for entry in entries]
    return Message("POST", SCREENINGS, replies.to_json({"blades": blades, **rest}), headers=headers)


def _sent_ahead(piece: list[Entry], first: int) -> Conversation[Entry]:
    name = f"blades-{first}.ndjson" if first else "blades.ndjson"
    content = b"".join(entry.content + b"\n" for entry in piece)
    kept = yield from send(content, name, LINES)
    return Entry(replies.to_json({"upload": kept.id}), False)


def _body_too_long(problem: ServiceProblem) -> bool:
    return problem.problem.get("status") == 413 and problem.problem.get("field") == "body"


def _placed(problem: ServiceProblem, firsts: Sequence[int]) -> ServiceProblem:
    """A refusal that names a line of a piece, or an entry as sent, as one that names that of `blades`.

    The remedy of a field of the order itself may begin with the blade that it does not fit.
    """
    told = dict(problem.problem)
    field, remedy = str(told.get("field", "")), str(told.get("remedy", ""))
    source = _FOR.match(remedy)
    found = field if source is None else source["source"]
    line, entry = _OF_PIECE.match(found), _OF_ORDER.match(found)
    if line is not None:
        place, end = int(line["first"] or 0) + int(line["line"]) - 1, line.end()
    elif entry is not None and int(entry["entry"]) < len(firsts):
        place, end = firsts[int(entry["entry"])], entry.end()
    else:
        return problem
    where = f"blades[{place}]{found[end:]}"
    told["detail"] = str(told.get("detail", "")).replace(found, where, 1)
    if source is None:
        told["field"] = where
    else:
        told["remedy"] = remedy.replace(found, where, 1)
    return ServiceProblem(told, problem.temporary, problem.retry_after_s)
