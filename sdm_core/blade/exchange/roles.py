"""Which of the matrices at hand is the mass, and which the stiffness at which rotor speed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sdm_core.blade.exchange.checks.findings import Finding, note, warning
from sdm_core.blade.exchange.content import FileContent
from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import InvalidInput

# K, KAA, KAAX, KGG, KAAX1, K_2, stiffness, ... and the same with M.
_SETS = "(?:aax|gg|aa|ff|ll|xx|red|reduced)?"
_STIFFNESS = re.compile(rf"(?:.*[_.\-])?(?:k_?{_SETS}|stiff(?:ness)?(?:_?matrix)?)_?(\d*)", re.IGNORECASE)
_MASS = re.compile(rf"(?:.*[_.\-])?(?:m_?{_SETS}|mass(?:_?matrix)?)", re.IGNORECASE)


@dataclass(frozen=True)
class Held:
    """A matrix and the file that holds it."""

    content: FileContent
    name: str

    @property
    def matrix(self) -> Matrix:
        return self.content.matrices[self.name]

    @property
    def where(self) -> str:
        return f"{self.content.path.name}: {self.name}"

    def called(self, reference: str) -> bool:
        """Whether a caller means this one: by name, by file, or by ``file:name``."""
        file = self.content.path.name
        return reference.lower() in (self.name.lower(), file.lower(), f"{file}:{self.name}".lower())


@dataclass(frozen=True)
class Roles:
    """The matrices of a model."""

    mass: Held
    stiffness: tuple[tuple[float, Held], ...]
    findings: tuple[Finding, ...]


def roles(
    contents: Sequence[FileContent],
    stiffness: str | Mapping[float, str] | None,
    mass: str | None,
) -> Roles:
    """Mass and stiffness as named by the caller, by the files, or by their usual names.

    Raises
    ------
    InvalidInput
        When one is missing, or more than one may be meant.
    """
    square = [
        Held(content, name)
        for content in contents
        for name, matrix in content.matrices.items()
        if matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1]
    ]
    have = ", ".join(held.where for held in square)[:110] or "none"
    found: list[Finding] = []
    if mass is not None:
        m = _named("mass", mass, square, have)
    else:
        m = _only("mass", [held for held in square if _MASS.fullmatch(held.name)], have)
    speeds = {name: value for content in contents for name, value in content.speed_hz.items()}
    if isinstance(stiffness, Mapping):
        if not stiffness:
            raise InvalidInput("stiffness", "{}", 'name a matrix a speed, e.g. {0.0: "K"}')
        ks = [(speed, _named(f"stiffness[{speed}]", ref, square, have)) for speed, ref in stiffness.items()]
    elif isinstance(stiffness, str):
        k = _named("stiffness", stiffness, square, have)
        ks = [(_speed(k, found), k)]
    elif speeds:
        ks = [_of_table(name, value, square, have) for name, value in speeds.items()]
        # One whose speed was lost must not be left out silently.
        for held in square:
            told = any(held.content is k.content and held.name == k.name for _, k in ks)
            if _STIFFNESS.fullmatch(held.name) and not told and held is not m:
                raise InvalidInput(
                    held.where,
                    "a stiffness without rotor speed, beside others with one",
                    'name those to take: stiffness={speed_hz: "name"}',
                )
    else:
        likely = [held for held in square if _STIFFNESS.fullmatch(held.name) and held is not m]
        k = _only("stiffness", likely, have)
        ks = [(_speed(k, found), k)]
    if any(k.content is m.content and k.name == m.name for _, k in ks):
        raise InvalidInput("stiffness", m.where, "the same matrix is named as mass: name another")
    taken = [m, *(k for _, k in ks)]
    for held in square:
        if not any(held.content is other.content and held.name == other.name for other in taken):
            found.append(note(held.where, "a matrix that is neither mass nor a stiffness: left out"))
    return Roles(m, tuple(ks), tuple(found))


def _speed(held: Held, found: list[Finding]) -> float:
    if held.name in held.content.speed_hz:
        return held.content.speed_hz[held.name]
    found.append(
        warning(
            f"{held.where}: speed_hz",
            "the file does not say at which rotor speed: taken as at rest",
            f'give stiffness={{speed_hz: "{held.name}"}}, one entry a speed',
        )
    )
    return 0.0


def _of_table(name: str, speed: float, square: Sequence[Held], have: str) -> tuple[float, Held]:
    return speed, _named(f"stiffness[{speed:g}]", name, square, have)


def _named(field: str, reference: str, square: Sequence[Held], have: str) -> Held:
    fits = [held for held in square if held.called(str(reference))]
    if len(fits) == 1:
        return fits[0]
    if not fits:
        raise InvalidInput(field, reference, f"no square matrix is called so; the files hold {have}")
    raise InvalidInput(field, reference, f"{len(fits)} matrices are called so: write file:name; have {have}")


def _only(what: str, fits: Sequence[Held], have: str) -> Held:
    if len(fits) == 1:
        return fits[0]
    if not fits:
        raise InvalidInput(
            what,
            "missing",
            f"no matrix has a usual name of a {what}; the files hold {have}: name it, or add the file",
        )
    more = ", one a speed" if what == "stiffness" else ""
    raise InvalidInput(what, ", ".join(held.where for held in fits)[:110], f"more than one: name it{more}")
