"""Many speeds at once, and the maps made of them."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from liner_rubs import one_mode, rotor_37

from sdm_core.errors import Cancelled, InvalidInput
from sdm_core.interruption import checkpoint, interruptible
from sdm_core.time_domain.in_threads import in_threads
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.simulation import run_revolutions, simulate_rub
from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from sdm_core.time_domain.liner.speed_sweep import sweep_speeds
from sdm_core.time_domain.liner.wear_lobes import wear_lobes
from sdm_core.time_domain.liner.wear_map import WearMap

SPEEDS = np.array([180.0, 230.0, 290.0])
METHOD = CentralDifferences(400)
BANDS = np.linspace(0.0, 6000.0, 121)


def test_a_sweep_is_the_simulations_of_its_speeds_in_order():
    rub, seen = rotor_37(("LE", "TE")), []
    found = sweep_speeds(
        rub, SPEEDS, 8, METHOD, frequency_hz=BANDS, progress=lambda done, of: seen.append((done, of))
    )
    assert seen == [(1, 3), (2, 3), (3, 3)]
    for speed, result in zip(SPEEDS, found.results, strict=True):
        alone = simulate_rub(rub, speed, 8, METHOD)
        assert result.speed_hz == speed
        np.testing.assert_array_equal(result.worn_m, alone.worn_m)
        np.testing.assert_array_equal(result.spectrum_m, alone.spectrum(BANDS))
        assert tuple(result.lobes) == tuple(lobes.count for lobes in alone.lobes)
    for node in ("LE", "TE"):
        wear = WearMap.of_sweep(found, node, angles=100)
        each = [r.worn_m[rub.nodes.index(node)].reshape(100, 4).max(axis=1) for r in found.results]
        np.testing.assert_array_equal(wear.worn_m, each)
    assert wear.speed_ratio == pytest.approx(SPEEDS / rub.blade.first_frequency_hz)


def test_a_liner_worn_through_at_one_speed_does_not_stop_the_others():
    thick, method = rotor_37(yield_force_n=20.0), CentralDifferences(400)
    depth = {s: run_revolutions(thick, s, 20, method).worn_m.max() for s in SPEEDS}
    limit = float(np.mean(sorted(depth.values())[-2:]))
    # The same bars, only shorter ones: E and K shrink with L.
    liner = thick.liner
    ratio = limit / liner.thickness_m
    thin = replace(
        liner,
        thickness_m=limit,
        youngs_modulus_pa=liner.youngs_modulus_pa * ratio,
        plastic_modulus_pa=liner.plastic_modulus_pa * ratio,
    )
    found = sweep_speeds(replace(thick, liner=thin), SPEEDS, 20, method, frequency_hz=BANDS)
    expected = [s for s in SPEEDS if depth[s] > limit]
    assert 0 < len(expected) < 3
    assert list(found.worn_through_hz) == expected
    full = [len(r.worn_volume_m3) for r in found.results if not r.worn_through]
    assert full == [20] * (3 - len(expected))


def test_a_sweep_that_is_given_up_leaves_no_thread_behind():
    def soon() -> None:
        raise Cancelled("given up")

    with interruptible(soon), pytest.raises(Cancelled, match="given up"):
        sweep_speeds(rotor_37(), np.linspace(100.0, 300.0, 50), 2000, METHOD, frequency_hz=BANDS)
    assert not [t for t in threading.enumerate() if t.name.startswith("revolutions")]


def test_work_begun_in_threads_stops_at_its_next_checkpoint_when_the_caller_gives_up():
    stopped, ran_out = [], []

    def soon() -> None:
        raise Cancelled("given up")

    def patient(part: float) -> float:
        try:
            for _ in range(20_000):
                checkpoint()
                time.sleep(1e-3)
        except Cancelled:
            stopped.append(part)
            raise
        ran_out.append(part)
        return part

    with interruptible(soon), pytest.raises(Cancelled, match="given up"):
        list(in_threads(patient, [1.0, 2.0, 3.0, 4.0], 2))
    assert sorted(stopped) == [1.0, 2.0]
    assert not ran_out


def test_what_one_speed_cannot_take_is_refused_before_any_is_simulated():
    with pytest.raises(InvalidInput, match="at least"):
        sweep_speeds(rotor_37(), [20.0, 290.0], 5, CentralDifferences(200, 1), frequency_hz=BANDS)
    with pytest.raises(InvalidInput, match="need 600"):
        sweep_speeds(rotor_37(), [20.0, 290.0], 5, CentralDifferences(800), frequency_hz=BANDS)


def test_maps_are_kept_whole_in_npz(tmp_path):
    found = sweep_speeds(rotor_37(), SPEEDS, 6, METHOD, frequency_hz=BANDS, node="TE")
    wear, spectrum = WearMap.of_sweep(found), SpectrumMap.of_sweep(found)
    wear.save(tmp_path / "wear.npz")
    spectrum.save(tmp_path / "spectrum.npz")
    with np.load(tmp_path / "wear.npz") as kept:
        np.testing.assert_array_equal(kept["worn_m"], wear.worn_m)
        assert str(kept["node"]) == "LE"
    with np.load(tmp_path / "spectrum.npz") as kept:
        assert kept["amplitude_m"].shape == (3, 121)
        assert str(kept["node"]) == "TE"
    assert spectrum.engine_orders(np.array([2, 4]))[1] == pytest.approx([460.0, 920.0])
    assert spectrum.natural_hz[0] == pytest.approx(
        rotor_37().blade.at_speeds(SPEEDS[:1])[0][0] / (2 * np.pi), rel=1e-12
    )


def test_a_spectrum_shows_the_amplitude_of_a_sine_at_its_frequency():
    rub = LinerRub(one_mode(0.0), ("tip",), AbradableLiner.from_cutting_stiffness(1e4), Casing(0.25, 0.1))
    start = InitialMotion([1e-5])
    found = simulate_rub(rub, 37.0, 30, CentralDifferences(1000), initial=start)
    lines = np.linspace(50.0, 150.0, 1001)
    spectrum = found.spectrum(lines)
    assert lines[spectrum.argmax()] == pytest.approx(100.0, abs=0.1)
    assert spectrum.max() == pytest.approx(3e-5, rel=1e-3)
    bent = replace(found, position=found.position + 1e-3)
    assert bent.spectrum(np.linspace(0.0, 20.0, 21)).max() < 1e-6, "standing deflection is no vibration"
    with pytest.raises(InvalidInput, match="samples_per_revolution"):
        found.spectrum(np.linspace(0.0, 1e6, 10))


def test_wear_lobes_name_the_ovalisation_apart():
    angle = 2 * np.pi * np.arange(720) / 720
    profile = 1e-4 * (3 + 2 * np.cos(2 * angle) + np.cos(7 * angle + 1))
    apart, alone = wear_lobes(profile, 2), wear_lobes(profile)
    assert (apart.count, alone.count) == (7, 2)
    assert apart.amplitude_m == pytest.approx(1e-4)
    assert apart.ovalisation_amplitude_m == pytest.approx(2e-4)
    assert wear_lobes(np.full(720, 1e-4)).count == 0
    assert wear_lobes(np.zeros(720), 2).count == 0
