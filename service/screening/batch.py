"""Many blades screened one after the other, so that one that cannot be does not stop the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled, InvalidInput, RubscreenError
from service.answerer import Answerer
from service.client import ServiceProblem
from service.screening.screen import ScreeningReport, ScreeningResult, risk, screen
from service.screening.sweep import Progress
from service.speeds import SpeedRange

ContactsOf = Callable[[Blade], Mapping[str, ContactConfiguration]]


@dataclass(frozen=True)
class Failure:
    """A blade that could not be read or screened: where it comes from, and why in one line."""

    source: str
    reason: str

    @classmethod
    def of(cls, source: str, error: RubscreenError) -> Failure:
        """From the error that stopped it."""
        said = str(error)
        if isinstance(error, InvalidInput):
            said = f"{error.field} = {error.value}: {error.remedy}"
        return cls(source, " ".join(said.split()))

    def to_dict(self) -> dict[str, str]:
        """As JSON."""
        return {"source": self.source, "reason": self.reason}


@dataclass(frozen=True)
class ScreenedBatch:
    """What became of every blade asked for.

    Attributes
    ----------
    report
        Those that were screened, ranked together.
    blades, sources
        The screened blades in the order given, and where each comes from.
    failures
        Those that were not.
    ignored
        Files of the folders that are no blade files by name.
    """

    report: ScreeningReport
    blades: tuple[Blade, ...]
    sources: tuple[str, ...]
    failures: tuple[Failure, ...] = ()
    ignored: tuple[str, ...] = ()

    def of_blade(self, blade: Blade) -> tuple[ScreeningResult, ...]:
        """The results of one blade, ranked."""
        return tuple(row for row in self.report.results if row.blade is blade)

    def to_dict(self) -> dict[str, Any]:
        """The report as JSON, with what was not screened."""
        return {
            **self.report.to_dict(),
            "blades": [
                {"blade": blade.name, "source": source}
                for blade, source in zip(self.blades, self.sources, strict=True)
            ],
            "failures": [failure.to_dict() for failure in self.failures],
            "ignored": list(self.ignored),
        }


def screen_each(
    blades: Sequence[tuple[Blade, str]],
    contacts: ContactsOf,
    answerer: Answerer,
    *,
    alone: bool = False,
    speed_range: SpeedRange | None = None,
    ke_max: float,
    ke_liner: float | None = None,
    map_shape: tuple[int, int] | None = None,
    policy: str = "auto",
    alpha: float | None = None,
    progress: Progress | None = None,
) -> tuple[ScreeningReport | None, tuple[tuple[Blade, str], ...], tuple[Failure, ...]]:
    """Screen blades given with their sources, each for itself; further arguments as of `screen`.

    Parameters
    ----------
    contacts
        Gives the contacts of a blade, by name.
    alone
        Let the error of a blade through instead of noting it: there is no other to go on with.

    Returns
    -------
    The report (None where no blade could be screened), the blades in it, and the failures.

    Raises
    ------
    ServiceProblem
        Where the service asked cannot be reached at all.
    """
    reports, kept, failures = [], [], []
    for i, (blade, source) in enumerate(blades):

        def told(done: int, total: int, text: str, i: int = i) -> None:
            if progress is not None and (done < total or i + 1 == len(blades)):
                progress(i * total + done, len(blades) * total, text)

        try:
            reports.append(
                screen(
                    [blade],
                    contacts(blade),
                    answerer,
                    speed_range=speed_range,
                    ke_max=ke_max,
                    ke_liner=ke_liner,
                    map_shape=map_shape,
                    policy=policy,
                    alpha=alpha,
                    progress=told,
                )
            )
        except RubscreenError as error:
            if alone or isinstance(error, Cancelled) or _unreachable(error):
                raise
            failures.append(Failure.of(source, error))
        else:
            kept.append((blade, source))
    return (ranked(reports) if reports else None), tuple(kept), tuple(failures)


def ranked(reports: Iterable[ScreeningReport]) -> ScreeningReport:
    """Several reports as one, safest first, in the order of `ScreeningReport`."""
    every = list(reports)
    results = sorted((row for report in every for row in report.results), key=risk)
    return ScreeningReport(tuple(results), every[0].model, every[0].solver)


def _unreachable(error: RubscreenError) -> bool:
    return isinstance(error, ServiceProblem) and error.problem.get("status") is None
