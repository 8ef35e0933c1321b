"""Charts are drawn for whatever an answer holds; what they look like is for eyes."""

from __future__ import annotations

import io
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

from sdm_core.contact import ContactConfiguration
from sdm_core.fourier_engagement import FourierEngagement
from service.screening import charts
from service.screening.charts import boundaries_png, described, map_png, ranking_png
from service.screening.screen import screen

SPEEDS = np.linspace(60.0, 210.0, 40)
KE = np.linspace(0.0, 2.5e4, 30)
LE = ContactConfiguration.at("LE")
GREY, DARK = 0.70, 0.40


def pixels(png: bytes) -> np.ndarray:
    return matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]


def share_of_axes(png: bytes, grey: float) -> float:
    """Share of the picture in one grey."""
    return float(np.mean(np.all(np.abs(pixels(png) - grey) < 0.01, axis=-1)))


def test_a_map_is_wide_enough_for_print(blade, lobes):
    height, width, _ = pixels(map_png(blade, LE, lobes.map(blade, LE, SPEEDS, KE))).shape
    assert width >= 2000
    assert height >= 1200


def test_grey_is_the_unstable_share_of_the_axes(blade, lobes):
    answers = lobes.map(blade, LE, SPEEDS, KE)
    exact = replace(answers, source=np.full(answers.stable.shape, "exact"))
    none = share_of_axes(map_png(blade, LE, replace(exact, stable=np.ones(answers.stable.shape))), GREY)
    all_of_it = share_of_axes(map_png(blade, LE, replace(exact, stable=np.zeros(answers.stable.shape))), GREY)
    some = share_of_axes(map_png(blade, LE, exact), GREY)
    assert (some - none) / (all_of_it - none) == pytest.approx(answers.unstable_share, abs=0.03)


def test_points_that_are_not_decided_are_neither_white_nor_grey(blade, lobes):
    answers = lobes.map(blade, LE, SPEEDS, KE)
    undecided = replace(answers, stable=np.full(answers.stable.shape, np.nan))
    assert share_of_axes(map_png(blade, LE, undecided), DARK) > 0.3
    assert share_of_axes(map_png(blade, LE, answers), DARK) < 0.01


@pytest.mark.parametrize("policy", ["exact", "surrogate"])
def test_a_boundary_is_drawn_whoever_answered_it(blade, lobes, policy):
    answers = lobes.map(blade, LE, SPEEDS, KE)
    bare = map_png(blade, LE, answers)
    lined = map_png(blade, LE, answers, lobes.boundary(blade, LE, SPEEDS, 2.5e4, policy))
    black = [float(np.mean(pixels(png).max(axis=-1) < 0.3)) for png in (bare, lined)]
    assert black[1] > black[0]


@pytest.mark.parametrize(
    ("exact", "labels"),
    [
        (slice(None), ["exact boundary"]),
        (slice(0, 20), ["boundary", "surrogate's boundary"]),
        (slice(0, 0), ["surrogate's boundary"]),
    ],
)
def test_a_boundary_is_called_exact_only_where_all_of_it_is(lobes, blade, exact, labels):
    boundary = lobes.boundary(blade, LE, SPEEDS, 2.5e4, "exact")
    boundary.source[:] = [("exact" if i in range(40)[exact] else "surrogate") for i in range(40)]
    axes = Figure().add_subplot()
    axes.set_ylim(0.0, 2.5e4)
    key, notes = charts._outline(axes, boundary)
    assert [line.get_label() for line in key] == labels
    assert notes == []


def test_no_boundary_is_a_note_not_a_key_without_a_mark(lobes, blade):
    axes = Figure().add_subplot()
    axes.set_ylim(0.0, 1000.0)
    key, notes = charts._outline(axes, lobes.boundary(blade, LE, SPEEDS, 1000.0, "exact"))
    assert key == []
    assert notes == ["boundary: none below 1,000 N/m, by the exact core"]


def test_boundaries_without_any_crossing_are_still_a_chart(blade, lobes):
    none = lobes.boundary(blade, LE, SPEEDS, 1000.0, "exact")
    assert pixels(boundaries_png(blade, {"LE": none, "TE": none}, ke_liner=500.0)).size


def test_a_ranking_has_a_bar_a_row(blade, lobes):
    contacts = {f"c{i}": ContactConfiguration({"LE": 0.1 + i}) for i in range(12)}
    report = screen([blade], contacts, lobes, ke_liner=3000.0, map_shape=(5, 5))
    assert pixels(ranking_png(report)).shape[0] > 1500


def test_no_chart_touches_the_global_state_of_matplotlib(blade, lobes):
    import sys

    map_png(blade, LE, lobes.map(blade, LE, SPEEDS, KE))
    assert "matplotlib.pyplot" not in sys.modules


@pytest.mark.parametrize(
    ("contact", "words"),
    [
        (LE, "permanent contact at LE"),
        (ContactConfiguration({"LE": 1.0, "TE": 0.5, "N2": 0.0}), "permanent contact at LE and TE (× 0.5)"),
        (ContactConfiguration.at(*"abcdefghi"), "permanent contact at 9 nodes"),
        (ContactConfiguration.at("LE", arcs=[(0, 0.25), (0.9, 1.0)]), "contact at LE, arcs 0–0.25, 0.9–1"),
        (
            ContactConfiguration.at("LE", arcs=[(i / 5, i / 5 + 0.1) for i in range(5)]),
            "contact at LE, 5 arcs, 50% of the turn",
        ),
        (
            ContactConfiguration.at("LE", engagement=FourierEngagement(0.5, [0.4])),
            "contact at LE, engaged by 10% to 90% round the casing",
        ),
        (
            ContactConfiguration.at("LE", engagement=FourierEngagement(0.5)),
            "contact at LE, engaged by 50% round the casing",
        ),
        (ContactConfiguration.at("LE", engagement=FourierEngagement(1.0)), "permanent contact at LE"),
    ],
)
def test_a_contact_is_put_in_words(contact, words):
    assert described(contact) == words
