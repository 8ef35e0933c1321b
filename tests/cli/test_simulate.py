"""`rubscreen simulate`: the library's numbers, whole files, and refusals in one line."""

from __future__ import annotations

import json
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import LinerRub
from sdm_core.time_domain.liner.simulation import simulate_rub
from service import cli
from service.commands import outputs
from service.simulation.constants import LinerConstants
from service.simulation.order import SimulationOrder

ROTOR = example_blade("nasa_rotor_37")
QUICK = ["--revolutions", "8", "--cells", "2000"]
PNG = b"\x89PNG"


def run(*options: str):
    return CliRunner().invoke(cli.app, ["simulate", "nasa_rotor_37", *QUICK, *options])


def the_rub() -> LinerRub:
    liner = AbradableLiner(1.8e9, 15e6, 1.0e7, 5e-3, 3.4e-3, 1e-3)
    casing = Casing(max(ROTOR.tip_radius_m), 1e-4, 2e-4, 2, 5.0)
    return LinerRub(ROTOR, ("LE",), liner, casing)


def test_one_speed_gives_the_numbers_of_the_library_and_its_charts(tmp_path):
    files = ["--json", str(tmp_path / "one.json"), "--npz", str(tmp_path / "one.npz")]
    done = run("--speed", "250Hz", "--plastic-modulus", "1e7", *files, "--png", str(tmp_path / "charts"))
    assert done.exit_code == 0, done.output
    history = simulate_rub(the_rub(), 250.0, 8, CentralDifferences(2000, steps_per_cell=1))
    said = json.loads((tmp_path / "one.json").read_text())
    assert said["peak_m"] == [history.peak_m.tolist()]
    assert said["deepest_m"] == [[history.worn_m.max()]]
    assert said["wear_lobes"] == [[history.lobes[0].count]]
    assert said["worn_volume_m3"] == [history.worn_volume_m3[-1]]
    assert said["energy"]["work_of_contact_j"] == history.energy.contact_j[-1]
    with np.load(tmp_path / "one.npz") as kept:
        np.testing.assert_array_equal(kept["response_displacement_m"], history.displacement_m)
        np.testing.assert_array_equal(kept["worn_m"][0], history.worn_m)
    for name in ("response.png", "worn_profile.png"):
        assert (tmp_path / "charts" / name).read_bytes().startswith(PNG)
    assert "K_e 6,762 N/m" in done.output and "clearance 100 µm" in done.output


def test_a_range_gives_maps_whose_unstable_speeds_lie_in_the_exact_lobes(tmp_path):
    npz = tmp_path / "maps.npz"
    options = ["--speed", "94Hz:101Hz", "--speeds", "12", "--nodes", "LE,TE", "--npz", str(npz)]
    done = run(*options, "--png", str(tmp_path / "charts"))
    assert done.exit_code == 0, done.output
    with np.load(npz) as kept:
        np.testing.assert_array_equal(kept["speed_hz"], np.linspace(94.0, 101.0, 12))
        assert kept["worn_m"].shape == (12, 2, 1000)
        inside = [any(low <= hz <= high for low, high in kept["lobes_hz"]) for hz in kept["speed_hz"]]
        np.testing.assert_array_equal(kept["stable"] == 0.0, inside)
        assert 0 < sum(inside) < 12
        one = simulate_rub(
            LinerRub(ROTOR, ("LE", "TE"), LinerConstants().liner(), the_rub().casing),
            float(kept["speed_hz"][3]),
            8,
            SimulationOrder(ROTOR, tuple(kept["speed_hz"]), ("LE", "TE"), revolutions=8, cells=2000).method,
        )
        np.testing.assert_array_equal(kept["peak_m"][3], one.peak_m)
        np.testing.assert_array_equal(kept["worn_m"][3], one.worn_m.reshape(2, 1000, 2).max(axis=2))
    names = {path.name for path in (tmp_path / "charts").iterdir()}
    assert names == {"wear_map_1.png", "wear_map_2.png", "spectrum_map.png"}


def test_a_liner_worn_through_is_shown_and_ends_with_status_1(tmp_path):
    done = run("--speed", "250Hz", "--thickness", "1e-5", "--json", str(tmp_path / "one.json"))
    assert done.exit_code == 1
    assert "worn through" in done.output
    assert json.loads((tmp_path / "one.json").read_text())["worn_through"] == [True]


@pytest.mark.parametrize(
    ("options", "named", "remedy"),
    [
        (["--speed", "500Hz"], "--speed = 500Hz", "modal data from 0 to 300.8"),
        (["--speed", "250Hz", "--speeds", "20"], "--speeds = 20", "give a range"),
        (["--speed", "250"], "--speed = 250", "its unit"),
        (["--clearance=-1e-4"], "--clearance = -0.0001", "more clearance"),
        (["--clearance", "1e-4,2e-4"], "--clearance = 2 numbers", "one a contact node"),
        (["--clearance", "thin"], "--clearance = thin", "give metres"),
        (["--youngs-modulus", "0"], "--youngs-modulus = 0.0", "above 0"),
        (["--ke-liner", "2e6"], "--ke-liner = 2000000.0", "less than 1.224e+06 N/m"),
        (["--ke-liner", "1e4", "--plastic-modulus", "1e7"], "--ke-liner = 10000.0", "--plastic-modulus"),
        (["--lobes", "0"], "--lobes = 0", "from 1 to 200"),
        (["--cells", "3"], "--cells = 3", "from 4"),
        (["--revolutions", "0"], "--revolutions = 0", "from 1"),
        (["--threads", "0"], "--threads = 0", "from 1 up"),
        (["--nodes", "LE,XX"], "XX", "LE"),
        (["--friction", "-0.1", "--rotation", "1"], "--friction = -0.1", "from 0"),
        (["--friction", "0.1", "--rotation", "2"], "--rotation = 2", "give 1"),
        (["--rotation", "-1"], "--rotation = -1", "give --friction too"),
        (["--friction", "0.1"], "--rotation = left out", "no blade file tells"),
    ],
)
def test_bad_input_is_one_line_that_names_option_value_and_remedy(options, named, remedy):
    speed = [] if "--speed" in options or "--threads" in options else ["--speed", "250Hz"]
    if "--threads" in options:
        speed = ["--speed", "200Hz:250Hz", "--speeds", "3"]
    done = run(*speed, *options)
    assert done.exit_code == 2
    said = done.stderr.strip()
    assert said.startswith("rubscreen: ") and "\n" not in said
    assert named in said and remedy in said


def test_friction_is_refused_for_a_blade_without_tangential_shapes(tmp_path):
    document = blade_to_dict(ROTOR)
    for state in document["states"]:
        del state["mode_shape_tangential"]
    path = tmp_path / "blade.json"
    path.write_text(json.dumps(document))
    friction = ["--friction", "0.1", "--rotation", "1"]
    options = ["simulate", str(path), *QUICK, "--speed", "250Hz", *friction]
    done = CliRunner().invoke(cli.app, options)
    assert done.exit_code == 2
    assert "--friction" in done.stderr and "tangential mode shapes" in done.stderr


def test_an_interrupted_simulation_leaves_no_file_and_no_thread(tmp_path, monkeypatch):
    @contextmanager
    def interrupted(title: str):
        def show(done: int, of: int, text: str) -> None:
            raise KeyboardInterrupt

        yield show

    monkeypatch.setattr(outputs, "progress_bar", interrupted)
    files = ["--json", str(tmp_path / "a.json"), "--npz", str(tmp_path / "a.npz")]
    done = run("--speed", "200Hz:250Hz", "--speeds", "8", *files, "--png", str(tmp_path / "charts"))
    assert done.exit_code != 0
    assert [path for path in Path(tmp_path).rglob("*") if path.is_file()] == []
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("revolutions")]
