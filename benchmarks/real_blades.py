"""Wrong verdicts and boundary errors on blades of no distribution: 100 parametric ones and rotor 37."""

from __future__ import annotations

import numpy as np
from rich.progress import track
from rich.table import Table

from benchmarks.blade_family import random_profile
from sdm_core.blade import Blade, example_blade
from sdm_core.blade.build import build_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import RubscreenError
from training.calibration import CLASSES
from training.cases import CaseBatch
from training.contact_class import PERMANENT, in_words
from training.evaluation import evaluate
from training.labelling import truth
from training.reference_space import ReferenceSample
from training.registry import load_model
from training.space_filling import random_arcs

POINTS = 400  # a blade and class of contact
LOWEST_KAPPA, HIGHEST_KAPPA = 1e-4, 1.0


def parametric_blades(count: int = 100, seed: int = 5) -> list[Blade]:
    """Built from random profiles; those that cannot be built are left out."""
    rng, blades = np.random.default_rng(seed), []
    for i in track(range(count), "building blades"):
        try:
            blades.append(build_blade(random_profile(rng, f"blade-{i + 1:03d}")).blade)
        except RubscreenError as error:
            print(f"blade-{i + 1:03d} left out: {error}")
    return blades


def points(blade: Blade, contact: str, count: int, rng: np.random.Generator) -> ReferenceSample:
    """Random contact nodes, speeds from 0.05 of the first frequency up to the blade's largest, κ as in the
    reference space."""
    low, high = blade.speed_range_hz or (0.0, 0.8 * blade.first_frequency_hz)
    low = max(low, 0.05 * blade.first_frequency_hz)
    cases = []
    for speed in rng.uniform(low, high, count):
        nodes = list(blade.tip_nodes)
        chosen = {nodes[0], nodes[-1]} if rng.random() < 0.3 else {nodes[rng.integers(len(nodes))]}
        if rng.random() < 0.2:
            chosen = set(nodes)
        arcs = None
        if contact != PERMANENT:
            k = int(rng.integers(1, 5))
            arcs = random_arcs(rng, k, rng.uniform(0.05, 0.8), evenness=2.0)[:k].tolist()
        held = ContactConfiguration(dict.fromkeys(sorted(chosen), 1.0), arcs)
        cases.append(CaseBatch.from_blade(blade, held, np.array([speed])))
    batch = CaseBatch.concatenate(cases)
    kappa = np.exp(rng.uniform(np.log(LOWEST_KAPPA), np.log(HIGHEST_KAPPA), count))
    return ReferenceSample(batch, kappa * batch.stiffness_scale)


def table(blades: list[Blade] | None = None, alpha: float = 1e-3) -> Table:
    """Rows by set of blades and class of contact, at one certified rate and without verification."""
    model = load_model()
    sets = {"parametric blades": blades or parametric_blades(), "rotor 37": [example_blade("nasa_rotor_37")]}
    out = Table(title=f"model {model.id}, rate {alpha:g}, against the exact core")
    for column in (
        "points of",
        "contact",
        "points",
        "outside",
        "",
        "false stable",
        "false unstable",
        "verified",
    ):
        out.add_column(column, justify="left" if column in ("points of", "contact", "") else "right")
    out.add_column("boundary error, median and 99 %", justify="right")
    for name, some in sets.items():
        for contact in CLASSES:
            rng = np.random.default_rng(31)
            each = POINTS if len(some) > 1 else 20_000
            parts = [points(blade, contact, each, rng) for blade in some]
            cases = CaseBatch.concatenate([p.cases for p in parts])
            sample = ReferenceSample(cases, np.concatenate([p.ke for p in parts]))
            critical, unstable = truth(sample.cases, sample.ke)
            inside = model.design_space.contains(sample.cases, sample.ke)
            certificate = model.certificate(contact)
            assert certificate is not None
            found = evaluate(
                model.surrogate.boundary(sample.cases),
                certificate.line(alpha).band,
                inside,
                sample.ke,
                critical,
                unstable,
                distribution=name,
                ke_max=model.design_space.largest_ke(sample.cases),
            )
            errors = f"{found.median_boundary_error:.3%}, {found.p99_boundary_error:.2%}"
            rows = (
                ("auto", found.auto),
                ("  within 25 %", found.auto_hard),
                ("alone", found.alone),
                ("  within 25 %", found.alone_hard),
            )
            for i, (what, f) in enumerate(rows):
                first = (
                    f"{len(some)} {name}",
                    in_words(contact),
                    f"{len(sample.ke):,}",
                    f"{(~inside).mean():.1%}",
                )
                out.add_row(
                    *(first if i == 0 else ("", "", "", "")),
                    what,
                    f"{f.false_stable} of {f.answered_stable:,}",
                    f"{f.false_unstable} of {f.answered_unstable:,}",
                    f"{f.exact_share:.2%}",
                    errors if i == 0 else "",
                )
            out.add_section()
    return out
