"""The service over the real screener: it serves what the exact core says, whatever becomes of the model."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.blade_sensitivity import critical_ke_sensitivities
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.fourier_engagement import FourierEngagement
from service.app import create_app
from service.client import Client
from service.rest.question_schemas import POINTS_EXAMPLE, SENSITIVITIES_EXAMPLE
from service.settings import Settings
from training.certificate import Certificate, CertifiedBand
from training.contact_class import PERMANENT
from training.design_space import DesignSpace
from training.registry import write_model
from training.screening import Screener
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

ONE_MODE = Blade("one mode", ("TIP",), 1e-3, [ModalState(0.0, np.array([100.0]), np.array([[1.0]]))])
TIP = ContactConfiguration.at("TIP")
CRITICAL = 2 * 1e-3 * 1.001 * (2 * np.pi * 100.0) ** 2  # 2ξ(1 + ξ)ω²


def untrained(folder: Path) -> str:
    """Write a model that knows nothing, and so must have everything verified; its identifier."""
    torch.manual_seed(0)
    architecture = Architecture(width=8, blocks=1)
    surrogate = Surrogate(BoundaryNetwork(architecture), architecture)
    lines = tuple(CertifiedBand(alpha, 1e6, 0, 0, 1.0, 0.0) for alpha in (1e-2, 5e-4))
    certificate = Certificate("none: untrained", PERMANENT, 0.5, 0, 0, lines, (1e6,))
    return write_model(surrogate, DesignSpace(), [certificate], {"trained_on": "nothing"}, folder).id


@pytest.fixture(scope="module")
def models_folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("models")
    untrained(folder)
    return folder


@pytest.fixture(scope="module")
def real(serving, models_folder) -> Iterator[httpx.Client]:
    """A service with the untrained model."""
    with (
        serving(create_app(Settings(models_folder=models_folder))) as url,
        httpx.Client(base_url=url, timeout=60.0) as client,
    ):
        yield client


def test_the_service_is_ready_with_a_model_from_its_folder(real, models_folder):
    (model_id,) = [p.name for p in models_folder.iterdir() if p.is_dir()]
    assert real.get("/readyz").json()["model"] == model_id
    (model,) = real.get("/v1/models").json()["models"]
    assert (model["id"], model["active"], model["card"]["trained_on"]) == (model_id, True, "nothing")


def test_critical_stiffness_over_http_is_two_xi_times_one_plus_xi(real):
    with Client(str(real.base_url)) as client:
        speeds = np.linspace(20.0, 80.0, 400)
        found = client.boundary(ONE_MODE, TIP, speeds, 1e5, "exact")
    assert np.nanmin(found.critical_ke) == pytest.approx(CRITICAL, rel=2e-3)
    assert np.nanmin(found.critical_ke) >= CRITICAL * (1 - 1e-6)


@pytest.mark.parametrize(
    "pattern",
    [{}, {"arcs": [(0.0, 0.25), (0.9, 0.95)]}, {"engagement": FourierEngagement(0.4, [0.3, 0.05])}],
    ids=["permanent", "arcs", "smooth"],
)
def test_points_map_and_boundary_over_http_agree_with_the_core(real, pattern):
    blade, contact = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE", "TE", **pattern)
    speeds, ke = np.array([150.0, 220.0, 286.0]), np.array([500.0, 3000.0, 20000.0])
    core = boundary(blade, contact, speeds, 25000.0)
    with Client(str(real.base_url)) as client:
        here = client.boundary(blade, contact, speeds, 25000.0, "exact")
        points = client.points(blade, contact, speeds, ke, "exact")
        grid = client.map(blade, contact, speeds, ke, "auto")
    np.testing.assert_array_equal(here.critical_ke, core.critical_ke)
    assert here.unstable_ke == core.unstable_ke
    for i, intervals in enumerate(core.unstable_ke):
        inside = [any(low < k < high for low, high in intervals) for k in ke]
        assert (grid.stable[:, i] == 0.0).tolist() == inside
        assert (points.stable[i] == 0.0) == inside[i]


@pytest.mark.parametrize("arcs", [None, [(0.0, 0.25), (0.9, 0.95)]], ids=["permanent", "arcs"])
def test_sensitivities_over_http_are_the_core_s(real, arcs):
    blade, contact = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE", "TE", arcs=arcs)
    speeds = np.array([170.0, 220.0])
    core = [critical_ke_sensitivities(blade, contact, speed, 1e5) for speed in speeds]
    with Client(str(real.base_url)) as client:
        here = client.sensitivities(blade, contact, speeds, 1e5)  # the untrained model verifies all
        none = client.sensitivities(blade, contact, speeds, 1.0, "exact")
    assert here.source.tolist() == ["exact", "exact"]
    for i, exact in enumerate(core):
        assert here.critical_ke[i] == pytest.approx(exact.value, rel=1e-9)
        for ours, theirs in zip(here.influences(i), exact.influences, strict=True):
            assert (ours.parameter, ours.unit) == (theirs.parameter, theirs.unit)
            assert ours.relative == pytest.approx(theirs.relative, rel=1e-6, abs=1e-9)
    assert none.influences(0) is None and np.isnan(none.critical_ke).all()


def test_smooth_engagement_has_no_sensitivities(real, problem):
    contact = {"weights": {"LE": 1.0}, "engagement": {"mean": 0.5, "cosine": [0.4]}}
    body = SENSITIVITIES_EXAMPLE | {"contact": contact}
    problem(real.post("/v1/sensitivities", json=body), 422, "contact.engagement")


def test_auto_says_why_the_core_had_to_answer(real):
    blade = example_blade("nasa_rotor_37")
    with Client(str(real.base_url)) as client:
        answers = client.points(blade, ContactConfiguration.at("LE"), [250.0, 12.0], [1e4, 1e4])
    assert answers.source.tolist() == ["exact", "exact"]
    assert answers.reason.tolist() == ["near_boundary", "out_of_domain"]
    assert np.isfinite(answers.spectral_radius).all() and np.isnan(answers.unstable_probability).all()


def test_the_surrogate_alone_outside_its_domain_is_refused(real, problem):
    body = POINTS_EXAMPLE | {"speed_hz": [250.0, 12.0], "policy": "surrogate"}
    document = problem(real.post("/v1/stability", json=body), 422, "policy")
    assert "12" in document["value"] + document["remedy"] and "exact" in document["remedy"]


def test_a_speed_the_modal_data_do_not_reach_is_refused(real, problem):
    with Client(str(real.base_url)) as client:
        for policy in ("auto", "exact", "surrogate"):
            with pytest.raises(Exception, match=r"speed_hz\[1\] = 900") as refused:
                client.points(
                    example_blade("nasa_rotor_37"),
                    ContactConfiguration.at("LE"),
                    [250.0, 900.0],
                    [1, 1],
                    policy,
                )
            assert refused.value.problem["status"] == 422


def test_more_exact_work_than_one_call_may_ask_for_is_refused(real, problem):
    body = POINTS_EXAMPLE | {
        "contact": {"weights": {"LE": 1.0}, "arcs": [[0.0, 0.25]]},
        "speed_hz": [100.0 + i / 100 for i in range(20_000)],
        "ke": [1e4] * 20_000,
        "policy": "exact",
    }
    problem(real.post("/v1/stability", json=body), 413, "speed_hz")


HURT = {
    "cut short": lambda model: (model / "model.safetensors").write_bytes(b"\x00" * 100),
    "a flipped byte": lambda model: _flip(model / "model.safetensors"),
    "gone": lambda model: (model / "model.safetensors").unlink(),
    "a card that is not JSON": lambda model: (model / "card.json").write_text("{"),
    "a card of another format": lambda model: (model / "card.json").write_text('{"format": "x"}'),
    "a pointer to nothing": lambda model: (model.parent / "active").write_text("0123456789abcdef\n"),
    "no pointer": lambda model: (model.parent / "active").unlink(),
}


def _flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize("how", HURT)
def test_a_damaged_model_leaves_a_service_that_says_so_and_answers_exactly(serving, problem, tmp_path, how):
    model_id = untrained(tmp_path)
    HURT[how](tmp_path / model_id)
    with (
        serving(create_app(Settings(models_folder=tmp_path))) as url,
        httpx.Client(base_url=url, timeout=60.0) as http,
    ):
        assert http.get("/healthz").status_code == 200
        answer = http.get("/readyz")
        document = problem(answer, 503, answer.json()["field"])
        assert "model" in document["field"] and 'policy "exact"' in document["remedy"]
        problem(http.post("/v1/stability", json=POINTS_EXAMPLE), 503, document["field"])
        exact = http.post("/v1/stability", json=POINTS_EXAMPLE | {"policy": "exact"})
        assert exact.status_code == 200 and exact.json()["model"] is None
        assert http.get("/v1/models").status_code == 200


FREQUENCIES = [
    [100.0, 100.0],
    [906.0, 906.0001],
    [1e7, 1e7],
    [100.0, 400.0],
    [1e-3, 9.0],
    [100.0, 1e6],
    [1.0, 1e7],
]


@pytest.mark.filterwarnings("default::RuntimeWarning")  # as outside the tests
@given(
    ratio=st.sampled_from([1e-6, 0.05, 0.3, 1.0, 100.0]),
    stiffness=st.sampled_from([0.0, 1e-9, 1e-3, 0.1, 1.0, 9.0, 1e9]),
    frequency=st.sampled_from(FREQUENCIES),
    amplitude=st.sampled_from([0.0, 1e-300, 1e-6, 1.0, -30.0, 1e6]),
    damping=st.sampled_from([0.0, 1e-12, 1e-3, 0.5, 0.9999999]),
    weight=st.sampled_from([1e-300, 1.0, 1e6]),
    arcs=st.sampled_from([None, [[0.0, 1.0]], [[0.0, 1e-9]], [[0.1, 0.4], [0.9, 1.05]]]),
    policy=st.sampled_from(["auto", "exact", "surrogate"]),
    path=st.sampled_from(["stability", "map", "boundary"]),
)
@settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
def test_any_blade_within_the_limits_is_answered_or_refused(
    real, ratio, stiffness, frequency, amplitude, damping, weight, arcs, policy, path
):
    assume(path != "boundary" or arcs in (None, [[0.0, 1.0]]))  # with arcs it is exact, and takes seconds
    body = {
        "blade": {
            "schema": "rubscreen/blade/1",
            "name": "extreme",
            "tip_nodes": ["LE"],
            "damping_ratio": damping,
            "states": [{"speed_hz": 0.0, "frequency_hz": frequency, "mode_shape": [[amplitude], [1.0]]}],
        },
        "contact": {"weights": {"LE": weight}, "arcs": arcs},
        "speed_hz": [ratio * max(frequency)],
        "policy": policy,
    }
    ke = stiffness * (2 * np.pi * frequency[1]) ** 2
    asked = {"stability": {"ke": [ke]}, "map": {"ke": [ke]}, "boundary": {"ke_max": ke or 1.0}}
    answer = real.post(f"/v1/{path}", content=json.dumps(body | asked[path]))
    assert answer.status_code in (200, 413, 422), answer.text


def test_the_shipped_model_answers_and_knows_its_limits(serving, question):
    screener = Screener.default()
    with serving(create_app()) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        assert http.get("/readyz").json()["model"] == screener.model_id
        assert http.get("/v1/models").json()["models"][0]["id"] == screener.model_id
        reply = http.post("/v1/stability", json=question(speed_hz=[286.0] * 50, ke=[50.0] * 50)).json()
        assert reply["source"] == ["surrogate"] * 50
        assert reply["stable"] == [True] * 50
