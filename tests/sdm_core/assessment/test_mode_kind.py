"""Modes named from what the tip does: rigid motions made on purpose, and real blades."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sdm_core.assessment.mode_kind import Kind, mode_kinds
from sdm_core.assessment.tip_motion import tip_motion
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.errors import InvalidInput

RADIUS, CHORD, STAGGER, NODES = 0.4, 0.05, np.radians(35.0), 9
ALONG = CHORD * np.linspace(-0.5, 0.5, NODES)
Z, S = ALONG * np.cos(STAGGER), ALONG * np.sin(STAGGER)
FREQUENCY = [100.0, 300.0, 500.0, 900.0, 1400.0]


def tip(tangential: np.ndarray, axial: np.ndarray, **place) -> Blade:
    """A blade whose modes move the tip line as given, shape (n, r) each."""
    modes = len(tangential)
    state = ModalState(
        0.0,
        FREQUENCY[:modes],
        0.1 * tangential,
        mode_shape_radial=0.0 * tangential,
        mode_shape_tangential=tangential,
        mode_shape_axial=axial,
    )
    names = tuple(f"N{i}" for i in range(NODES))
    given = {"tip_radius_m": [RADIUS] * NODES, "tip_z_m": Z.tolist(), "tip_theta_rad": (S / RADIUS).tolist()}
    return Blade("rigid", names, 1e-3, [state], direction="radial", **{**given, **place})


def moved(
    flap: float = 0.0, edge: float = 0.0, turn: float = 0.0, bow: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Motion of the tip line: normal to the chord, along it, about its middle, and bent."""
    normal = flap + turn * ALONG / CHORD + bow * (np.cos(2 * np.pi * np.arange(NODES) / (NODES - 1)))
    return normal * np.cos(STAGGER) + edge * np.sin(STAGGER), -normal * np.sin(STAGGER) + edge * np.cos(
        STAGGER
    )


def kinds_of(*motions: dict[str, float], **place):
    both = [moved(**motion) for motion in motions]
    return mode_kinds(tip(np.array([t for t, _ in both]), np.array([z for _, z in both]), **place))


def test_a_tip_that_moves_as_a_whole_bends_and_one_that_turns_twists():
    found = kinds_of({"flap": 1.0}, {"edge": 1.0}, {"turn": 1.0}, {"flap": -2.0}, {"turn": 3.0})
    assert [kind.kind for kind in found] == [Kind.FLAP, Kind.EDGEWISE, Kind.TORSION, Kind.FLAP, Kind.TORSION]
    assert [kind.label for kind in found] == ["1F", "1E", "1T", "2F", "2T"]
    for kind in found:
        assert max(kind.translation, kind.rotation) == pytest.approx(1.0, abs=1e-12)
        assert kind.unexplained == pytest.approx(0.0, abs=1e-12)
        assert kind.approximate == ""


def test_shares_of_a_sum_of_motions_are_those_of_its_parts():
    """Translation a and rotation α about mid-chord: a² against α²c²/12, by the trapezoidal rule here."""
    weight = np.r_[0.5, np.ones(NODES - 2), 0.5] / (NODES - 1)
    inertia = weight @ (ALONG / CHORD) ** 2
    (found,) = kinds_of({"flap": 1.0, "turn": 2.0})
    assert found.rotation / found.translation == pytest.approx(4.0 * inertia, rel=1e-12)
    assert found.kind is Kind.BENDING or found.kind is Kind.FLAP or found.kind is Kind.MIXED
    assert found.translation + found.rotation + found.unexplained == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("at", [0.35, 0.5, 0.65])
def test_a_turn_about_an_elastic_axis_is_torsion_and_its_axis_is_found(at):
    (found,) = kinds_of({"turn": 1.0, "flap": 0.5 - at})
    assert found.kind is Kind.TORSION
    assert found.axis_from_le == pytest.approx(at, abs=1e-9)


def test_a_turn_about_an_edge_is_bending_and_one_between_is_mixed_with_its_shares_said():
    edge, between = kinds_of({"turn": 1.0, "flap": 0.5}, {"turn": 1.0, "flap": 0.3})
    assert edge.kind is Kind.FLAP
    assert edge.axis_from_le == pytest.approx(0.0, abs=1e-9)
    assert between.kind is Kind.MIXED
    assert "translation" in between.described
    assert f"{between.rotation:.0%}" in between.described


def test_a_tip_that_bows_is_bent_along_the_chord():
    (found,) = kinds_of({"bow": 1.0, "flap": 0.1})
    assert found.kind is Kind.CHORDWISE
    assert found.label == "1C"
    assert found.unexplained > 0.9


def test_sign_scale_and_place_of_the_origin_do_not_matter():
    base = kinds_of({"flap": 1.0, "turn": 0.7, "bow": 0.2})[0]
    other = kinds_of(
        {"flap": -5.0, "turn": -3.5, "bow": -1.0},
        tip_z_m=(Z + 0.7).tolist(),
        tip_theta_rad=(S / RADIUS + 1.1).tolist(),
    )[0]
    assert (other.translation, other.rotation) == pytest.approx((base.translation, base.rotation), abs=1e-9)


def test_without_stagger_or_directions_the_same_is_found_and_called_approximate():
    full = kinds_of({"flap": 1.0, "turn": 0.5}, {"turn": 1.0, "flap": 0.1}, {"bow": 1.0})
    tangential, axial = (
        np.array(u)
        for u in zip(
            *(moved(**m) for m in ({"flap": 1.0, "turn": 0.5}, {"turn": 1.0, "flap": 0.1}, {"bow": 1.0})),
            strict=True,
        )
    )
    blade = tip(tangential, axial)
    bare = replace(blade, tip_theta_rad=None)
    contact_only = replace(
        blade,
        states=[replace(s, mode_shape_tangential=None, mode_shape_axial=None) for s in blade.states],
        tip_theta_rad=None,
        tip_z_m=None,
    )
    for known in (bare, contact_only):
        found = mode_kinds(known)
        for mine, exact in zip(found, full, strict=True):
            assert (mine.translation, mine.rotation) == pytest.approx(
                (exact.translation, exact.rotation), abs=1e-9
            )
            assert mine.approximate
    assert "contact amplitudes alone" in mode_kinds(contact_only)[0].approximate
    assert mode_kinds(contact_only)[0].kind is Kind.BENDING


def test_rotor_37_has_two_flaps_two_torsions_and_a_bend_along_the_chord():
    found = mode_kinds(example_blade("nasa_rotor_37"))
    assert [kind.label for kind in found] == ["1B", "1T", "2B", "1C", "2T"]
    assert found[0].translation > 0.9
    assert found[1].rotation > 0.9


def test_axial_motion_follows_from_casing_normal_and_radial_where_the_casing_slopes():
    rotor = example_blade("nasa_rotor_37")
    motion = tip_motion(rotor, np.array([0.0]))
    assert motion.axial_derived
    slope = np.gradient(np.array(rotor.tip_radius_m), np.array(rotor.tip_z_m))
    back = (motion.radial - slope * motion.axial) / np.sqrt(1 + slope**2)
    np.testing.assert_allclose(back, motion.contact, rtol=1e-12)
    # The first flap moves the tip across the chord: axial and tangential against each other.
    assert (motion.axial[0, 0] * motion.tangential[0, 0] < 0).all()
    flat = tip_motion(example_blade("generic_compressor_blade"), np.array([0.0]))
    assert flat.axial is None
    assert any("axial" in said for said in flat.missing)


def test_two_tip_nodes_are_too_few():
    blade = Blade("b", ("LE", "TE"), 1e-3, [ModalState(0.0, [100.0], [[1.0, -1.0]])])
    with pytest.raises(InvalidInput, match="three or more"):
        mode_kinds(blade)
