"""The paper's figures: their numbers against known answers, and lines whose direction follows from them."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged
from service.paper_figures import fixed_steps, rubbing, study, time_convergence
from service.paper_figures.all_figures import BladeFigures
from service.paper_figures.bending_and_torsion import bending_and_torsion
from service.paper_figures.centrifugal_stiffening import centrifugal_stiffening
from service.paper_figures.contact_location import contact_location, flexibility
from service.paper_figures.fixed_steps import fixed_step_lobes, unstable_intervals
from service.paper_figures.lobes import Lobes, exact_lobes
from service.paper_figures.markdown_page import markdown_page
from service.paper_figures.modal_convergence import modal_convergence
from service.paper_figures.outline import outlines
from service.paper_figures.paper_figure import Claim, PaperFigure
from service.paper_figures.responses import responses
from service.paper_figures.stability_diagram import stability_diagram
from service.paper_figures.study import Study, at_rest, ke_axis, least_ke_of_modes, study_of, with_modes
from service.paper_figures.time_convergence import lobe_errors
from service.paper_figures.wear_maps import main_lobes

LE = ContactConfiguration.at("LE")


@pytest.fixture(autouse=True)
def _one_process(monkeypatch):
    monkeypatch.setattr(fixed_steps, "available_cores", lambda: 1)


@pytest.fixture
def narrow(monkeypatch):
    """Few lobes, so that figures take little time."""
    monkeypatch.setattr(study, "LOWEST_RATIO", 0.24)
    monkeypatch.setattr(study, "HIGHEST_RATIO", 0.36)
    monkeypatch.setattr(time_convergence, "_EVEN_SPEEDS", 25)


def blade_of(le=(3.0, 8.0), te=(2.0, 4.0), frequency=(900.0, 2500.0), rise=1.2, name="made") -> Blade:
    """Two modes at three nodes, frequencies `rise` times higher at 300 Hz; in between the middle of both."""
    shape = np.array([le, 0.5 * (np.array(le) - np.array(te)), -np.array(te)]).T
    states = [
        ModalState(speed, np.array(frequency) * factor, shape)
        for speed, factor in ((0.0, 1.0), (400.0, rise))
    ]
    return Blade(name, ("LE", "M", "TE"), 1e-3, states)


def studied(blade: Blade) -> Study:
    return Study(blade, 0, 1, "as made")


def claim(figure: PaperFigure, words: str) -> Claim:
    return next(one for one in figure.claims if words in one.paper)


# Lobes and their measures ---------------------------------------------------------------------------


def test_one_mode_becomes_unstable_at_two_xi_times_one_plus_xi():
    one = with_modes(at_rest(blade_of()), [0])
    speeds = 900.0 / np.linspace(2.5, 12.5, 4000)[::-1]
    found = exact_lobes("", one, LE, speeds, 900.0, 2.5e4).least(0.08, 0.4)
    known = 2e-3 * (1 + 1e-3) * (2 * np.pi * 900.0) ** 2 / 9.0
    assert found[0] == pytest.approx(known, rel=1e-4)
    assert least_ke_of_modes(one, LE) == pytest.approx(known, rel=1e-12)


def test_shares_are_areas():
    ratio = np.linspace(0.0, 1.0, 101)
    upper = Lobes("", ratio, tuple(((5.0, 12.0),) for _ in ratio), ke_max=10.0)
    middle = Lobes("", ratio, tuple(((2.0, 6.0),) for _ in ratio), ke_max=10.0)
    wedge = Lobes("", ratio, tuple(((10.0 * (1 - x), 12.0),) for x in ratio), ke_max=10.0)
    assert upper.share(0.0, 1.0) == pytest.approx(0.5)
    assert wedge.share(0.0, 1.0) == pytest.approx(0.5)
    assert wedge.share(0.5, 1.0) == pytest.approx(0.75)
    assert middle.share_not_in(upper, 0.0, 1.0) == pytest.approx(0.3)
    assert upper.share_not_in(middle, 0.0, 1.0) == pytest.approx(0.4)
    assert wedge.stretches(5.0, 0.0, 1.0) == [(pytest.approx(0.5), 1.0)]


def test_an_outline_follows_each_region_and_leaves_the_chart_where_it_does():
    intervals = ((), ((4.0, 12.0),), ((3.0, 12.0),), ((4.0, 12.0),), (), ((1.0, 2.0),), ((1.0, 2.0),))
    lobes = Lobes("", np.arange(7.0), intervals, ke_max=10.0)
    lobe, island = outlines(lobes, 0.0, 6.0)
    x, y = lobe.edge
    assert x[:5].tolist() == [0.5, 1.0, 2.0, 3.0, 3.5]
    assert y[:5].tolist() == [12.0, 4.0, 3.0, 4.0, 12.0]
    assert np.isnan(y[6:]).all()  # nothing is drawn along the top
    assert island.polygon[1].tolist() == [1.5, 1.0, 1.0, 2.0, 2.0]


def test_the_axis_is_the_papers_where_the_lobes_show_on_it():
    assert ke_axis([7000.0, 16000.0]) == 2.5e4
    assert ke_axis([17000.0]) == 5e4
    assert ke_axis([np.inf]) == 2.5e4


# Semi-discretization with fixed steps ---------------------------------------------------------------


@pytest.mark.parametrize(("low", "high"), [(0.31, 0.72), (0.522, 0.541)])
def test_an_unstable_stretch_is_found_also_between_the_stiffnesses_looked_at(low, high):
    found = unstable_intervals(lambda ke: (ke - low) * (high - ke), 1.0)
    assert np.allclose(found, [(low, high)], atol=4e-4)


def test_lobes_of_fixed_steps_are_where_the_dense_method_of_the_paper_crosses():
    blade = at_rest(blade_of())
    speeds = np.array([230.0, 257.0, 331.0])
    found = fixed_step_lobes("", 20, blade, LE, speeds, 900.0, 2.5e4, lambda: None)
    crossings = 0
    for speed, intervals in zip(speeds, found.unstable_ke, strict=True):
        for edge in {ke for pair in intervals for ke in pair if ke < 2.9e4}:
            equations = (RubbingBlade.from_blade(blade, LE, speed, edge * s) for s in (0.99, 1.01))
            radii = [abs(Averaged(20).multipliers(each.delay_equation())[0]) for each in equations]
            assert (radii[0] - 1) * (radii[1] - 1) < 0
            crossings += 1
    assert crossings >= 2


def test_errors_of_lobes_have_the_sign_of_the_unsafe_side():
    ratio = np.linspace(0.2, 0.5, 61)

    def lobes(deep: float, shallow: float) -> Lobes:
        """Two lobes, tips at 0.3 and 0.4, that meet at 0.35."""
        depth = np.where(ratio < 0.35, shallow, deep)
        first = depth + 1e5 * np.minimum(np.abs(ratio - 0.3), np.abs(ratio - 0.4))
        return Lobes("", ratio, tuple(((ke, 2e4),) if ke < 2e4 else () for ke in first), ke_max=2e4)

    exact = lobes(1000.0, 2000.0)
    wrong = lobe_errors(lobes(1030.0, 2400.0), exact)
    assert wrong.ratio.tolist() == pytest.approx([0.4, 0.3])
    assert wrong.error.tolist() == pytest.approx([0.03, 0.2])
    assert wrong.superimposed_from() == pytest.approx(0.4)
    assert wrong.worst(0.2, 0.5) == (pytest.approx(0.2), pytest.approx(0.3))
    assert lobe_errors(lobes(900.0, 2000.0), exact).error[0] == pytest.approx(-0.1)
    assert lobe_errors(lobes(1000.0, 3e4), exact).error[1] > 1
    assert lobe_errors(exact, exact).superimposed_from() == pytest.approx(0.3)


def test_coarse_steps_err_on_the_unsafe_side_and_finer_ones_less(narrow):
    ticks = []
    figure = time_convergence.time_convergence(studied(blade_of()), lambda: ticks.append(1))
    assert len(ticks) == time_convergence.time_convergence_parts(studied(blade_of()))
    missed = [one["unstable_called_stable"] for one in figure.numbers["steps"]]
    assert missed[0] > missed[1] > missed[2] > 0
    assert max(one["stable_called_unstable"] for one in figure.numbers["steps"]) < 0.1 * missed[2]
    worst = [np.abs(one["lobe_ke_error"]).max() for one in figure.numbers["steps"]]
    # Second order: errors fall as 1/N².
    assert worst[1] / worst[2] == pytest.approx((80 / 60) ** 2, rel=0.1)
    said = claim(figure, "N = 40")
    assert said.holds is bool(worst[0] <= 0.05)


# Lines beside the figures ---------------------------------------------------------------------------


def test_the_worse_edge_is_named_whichever_it_is(narrow):
    worse_le = contact_location(studied(blade_of()))
    worse_te = contact_location(studied(blade_of(le=(2.0, 4.0), te=(3.0, 8.0))))
    assert claim(worse_le, "leading edge").holds is True
    assert "share at the leading edge is" in worse_le.agrees
    assert claim(worse_te, "leading edge").holds is False
    assert "share at the trailing edge is" in worse_te.differs
    shares = [figure.numbers["unstable_share"] for figure in (worse_le, worse_te)]
    assert shares[0]["leading edge"] == pytest.approx(shares[1]["trailing edge"], rel=1e-6)


def test_flexibility_is_the_static_displacement_per_force():
    blade = blade_of()
    by_hand = (3.0 / (2 * np.pi * 900)) ** 2 + (8.0 / (2 * np.pi * 2500)) ** 2
    assert flexibility(studied(blade), LE) == pytest.approx(by_hand, rel=1e-12)


def test_stiffening_enlarges_the_stable_domain_and_softening_does_not(narrow):
    stiffening = claim(centrifugal_stiffening(studied(blade_of(rise=1.2))), "enlarges")
    softening = claim(centrifugal_stiffening(studied(blade_of(rise=0.85))), "enlarges")
    assert stiffening.holds is True
    assert "grows" in stiffening.here
    assert softening.holds is False
    assert "shrinks" in softening.here


def test_a_second_mode_that_does_not_move_the_edge_adds_nothing(narrow):
    without = modal_convergence(studied(blade_of(le=(3.0, 0.0))))
    assert claim(without, "mode 2 adds").holds is False
    assert without.numbers["added_by_mode_2"] == pytest.approx(0.0, abs=1e-9)
    assert claim(modal_convergence(studied(blade_of())), "mode 2 adds").holds is True


def test_bending_or_torsion_comes_first_as_the_amplitudes_say(narrow):
    bending = claim(bending_and_torsion(studied(blade_of(le=(3.0, 6.0)))), "smaller K_e")
    torsion = claim(bending_and_torsion(studied(blade_of(le=(3.0, 12.0)))), "smaller K_e")
    assert (bending.holds, torsion.holds) == (True, False)


@pytest.mark.parametrize(
    ("example", "stable"), [("nasa_rotor_37", False), ("generic_compressor_blade", True)]
)
def test_the_papers_upper_test_point_is_judged_by_the_exact_core(narrow, example, stable):
    """Rotor 37 is unstable at 2e4 N/m as the paper's blade is; the generic one's floor is 21,600 N/m."""
    figure = stability_diagram(study_of(example_blade(example)))
    lower, upper = figure.marks
    assert lower.stable is True
    assert upper.stable is stable
    assert claim(figure, "20,000").holds is not stable
    inside = any(
        a <= 2e4 <= b
        for a, b in figure.curves[0].unstable_ke[int(np.argmin(np.abs(figure.curves[0].ratio - upper.ratio)))]
    )
    assert inside is not stable


def test_lines_name_what_was_not_comparable_and_what_the_paper_says():
    claims = (Claim("the paper's", "what is here", False), Claim("that", "too few", None))
    figure = PaperFigure(number=5, title="", blade="", claims=claims)
    assert figure.agrees == "Nothing, of 2 statements compared."
    assert figure.differs == (
        "What is here (the paper: the paper's); too few (not comparable; the paper: that)."
    )


def test_responses_grow_and_settle_as_their_multipliers_say():
    figure = responses(study_of(example_blade("nasa_rotor_37")))
    for row in figure.numbers["responses"]:
        assert row["growth_fitted"] == pytest.approx(row["growth_of_multiplier"], abs=1e-9)
        assert row["frequency_fitted_hz"] == pytest.approx(row["chatter_hz"], rel=1e-9)
    for panel in figure.panels:
        stable, unstable = panel.histories
        assert stable.stable and not unstable.stable
        for history in (stable, unstable):
            # Each begins at 2 mm, at rest.
            assert history.displacement[0] == pytest.approx(2e-3, rel=1e-9)
            assert history.displacement[1] == pytest.approx(2e-3, rel=2e-2)
            each = [
                np.abs(history.displacement[history.revolution.astype(int) == k]).max() for k in range(30)
            ]
            assert np.log(each[-1] / each[15]) * history.growth_per_revolution > 0
    assert all(claim.holds for claim in figure.claims)
    faster, slower = (panel.histories[1].growth_per_revolution for panel in figure.panels)
    assert faster > slower > 0


def test_the_shipped_blades_begin_with_bending_and_torsion():
    for name in ("nasa_rotor_37", "generic_compressor_blade"):
        found = study_of(example_blade(name))
        assert (found.bending, found.torsion) == (0, 1)


# The command ----------------------------------------------------------------------------------------


def test_the_command_writes_every_figure_a_page_and_the_numbers(rubscreen, narrow, monkeypatch, tmp_path):
    monkeypatch.setattr(study, "LOWEST_RATIO", 0.30)
    monkeypatch.setattr(time_convergence, "_EVEN_SPEEDS", 10)
    monkeypatch.setattr(rubbing, "SPEEDS", 3)
    monkeypatch.setattr(rubbing, "REVOLUTIONS", 20)
    out = tmp_path / "paper"
    result = rubscreen("paper", "--out", str(out))
    assert result.exit_code == 0, result.output
    document = json.loads((out / "figures.json").read_text())
    assert document["schema"] == "rubscreen/paper-figures/1"
    drawn = [(figure["blade"], figure["figure"]) for figure in document["figures"]]
    assert drawn == [
        (blade, number)
        for blade in ("nasa-rotor-37", "generic-compressor-blade")
        for number in (5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
    ]
    page = (out / "index.html").read_text()
    assert page.count("data:image/png;base64,") == 20
    assert not re.search(r"<script|https?://|src=\"(?!data:)", page)
    for figure in document["figures"]:
        assert (out / figure["picture"]).read_bytes().startswith(b"\x89PNG")
        for line in ("agrees", "differs"):
            assert figure[line].replace("K_e", "K<sub>e</sub>").replace("'", "&#x27;") in page


def test_the_documentation_page_names_every_picture_and_verdict():
    claims = (
        Claim("a | b", "1 < 2", True),
        Claim("K_e* counts", "it does not", False),
        Claim("c", "d", None),
    )
    figures = tuple(
        PaperFigure(number=number, title=f"title {number}", blade="made", claims=claims, notes=("noted",))
        for number in (5, 14)
    )
    blades = [BladeFigures(studied(blade_of()), ("about it",), figures)]
    page = markdown_page(blades, [["five.png", "fourteen.png"]], "rubscreen paper")
    assert re.findall(r"!\[.*\]\((.*)\)", page) == ["five.png", "fourteen.png"]
    for verdict in ("Agrees", "Differs", "Cannot be compared"):
        assert page.count(f"**{verdict}**") == len(figures)
    rows = [line for line in page.splitlines() if line.startswith("| Fig.")]
    assert len(rows) == len(figures) * len(claims)
    # A bar in a statement is no column, a star no emphasis, a sign of less no tag.
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 4 for row in rows)
    assert r"K\_e\* counts" in page and r"1 \< 2" in page


def test_the_main_lobes_of_a_profile_are_its_strongest_harmonic():
    angle = 2 * np.pi * np.arange(500) / 500
    grooves = np.maximum(0.0, np.cos(2 * angle) - 0.5)
    assert main_lobes(np.array([grooves, grooves + 0.4 * np.cos(7 * angle)])).tolist() == [2, 7]


def test_radial_amplitudes_are_drawn_on_request_and_others_refused(rubscreen, narrow, tmp_path):
    refused = rubscreen("paper", "--out", str(tmp_path), "--direction", "axial")
    assert refused.exit_code == 2
    assert "axial" in refused.stderr
    assert "mode_shape_radial" in refused.stderr
