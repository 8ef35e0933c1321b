"""Many profiles built, shared by processes; one that cannot be built does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from threadpoolctl import threadpool_limits

from sdm_core.blade.build import BladeBuild, build_blade
from sdm_core.blade.profile.blade_profile import BladeProfile
from sdm_core.errors import RubscreenError
from sdm_core.parallel import available_cores, checked_workers, shared

# A build of this many nodes takes about as long as workers take to start.
_NODES_TO_SHARE = 1000


def build_each(
    profiles: Sequence[BladeProfile],
    *,
    verify: bool = True,
    workers: int | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> list[BladeBuild | RubscreenError]:
    """What each profile became: a build, or the error that names why there is none.

    Parameters
    ----------
    verify
        As of `build_blade`.
    workers
        Processes; None: all cores where it pays.
    progress
        Told how many of how many are done, and the last one's name.

    Returns
    -------
    In the order of the profiles.
    """
    profiles = list(profiles)
    nodes = sum(profile.subdivision.node_count for profile in profiles)
    if workers is None:
        workers = available_cores() if nodes >= _NODES_TO_SHARE and len(profiles) > 1 else 1
    else:
        workers = checked_workers(workers)
    out: list[BladeBuild | RubscreenError | None] = [None] * len(profiles)
    parts = [(profile, verify) for profile in profiles]
    for done, (i, result) in enumerate(shared(_built, parts, workers), 1):
        out[i] = result
        progress(done, len(profiles), profiles[i].name)
    return [result for result in out if result is not None]


def _built(part: tuple[BladeProfile, bool]) -> BladeBuild | RubscreenError:
    profile, verify = part
    try:
        with threadpool_limits(1):
            return build_blade(profile, verify=verify)
    except RubscreenError as error:
        return error
