"""The client answers as the screener behind the service does, and says what went wrong."""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator
from dataclasses import fields

import httpx
import numpy as np
import pytest

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile
from service.answerer import Answerer
from service.client import Client, Patience, ServiceProblem
from service.rest import replies

BLADE = example_blade("nasa_rotor_37")
CONTACT = ContactConfiguration.at("LE", "TE", arcs=[(0.0, 0.25), (0.9, 0.95)])
ONCE = Patience(attempts=1)
SPEEDS = np.array([100.0, 200.0, 286.5])
KE = np.array([1e3, 1e4, 2e6])


@pytest.fixture
def client(shared_address) -> Iterator[Client]:
    with Client(shared_address, timeout=20.0) as client:
        yield client


def _same(found: object, expected: object) -> None:
    assert type(found) is type(expected)
    for field in fields(expected):  # type: ignore[arg-type]
        a, b = getattr(found, field.name), getattr(expected, field.name)
        if isinstance(b, np.ndarray):
            assert a.shape == b.shape and a.dtype.kind == b.dtype.kind, field.name
            np.testing.assert_array_equal(a, b, err_msg=field.name)
        else:
            assert a == b, field.name


@pytest.mark.parametrize("policy", ["auto", "exact"])
def test_the_client_answers_what_the_screener_answers(client, screener, policy):
    near: Answerer = screener
    far: Answerer = client
    _same(far.points(BLADE, CONTACT, SPEEDS, KE, policy), near.points(BLADE, CONTACT, SPEEDS, KE, policy))
    _same(far.map(BLADE, CONTACT, SPEEDS, KE[:2], policy), near.map(BLADE, CONTACT, SPEEDS, KE[:2], policy))
    for ke_max in (1e3, 1e5):
        asked = (BLADE, CONTACT, SPEEDS, ke_max, policy)
        _same(far.boundary(*asked), near.boundary(*asked))
        _same(far.sensitivities(*asked), near.sensitivities(*asked))


def test_the_client_asks_for_a_rate_and_is_told_what_was_used(client, screener):
    for far, near in ((client.points, screener.points), (client.map, screener.map)):
        found = far(BLADE, CONTACT, SPEEDS, KE, alpha=1e-3)
        _same(found, near(BLADE, CONTACT, SPEEDS, KE, alpha=1e-3))
        assert found.certificate.distribution == "rules/1"
        with pytest.raises(ServiceProblem, match="alpha"):
            far(BLADE, CONTACT, SPEEDS, KE, alpha=2e-3)
    for ask in (client.boundary, client.sensitivities):
        assert ask(BLADE, CONTACT, SPEEDS, 1e5, alpha=1e-3).certificate.spreads == 12.0


def test_a_map_of_a_service_that_knows_no_certificates_is_still_read(screener):
    near = screener.map(BLADE, CONTACT, SPEEDS, KE)
    with np.load(io.BytesIO(replies.map_to_npz(near)), allow_pickle=False) as npz:
        older = {name: npz[name] for name in npz.files if name != "certificate"}
    buffer = io.BytesIO()
    np.savez(buffer, **older)
    assert replies.map_from_npz(buffer.getvalue()).certificate is None


def test_stability_is_the_clients_other_name_for_points(client):
    _same(client.stability(BLADE, CONTACT, SPEEDS, KE), client.points(BLADE, CONTACT, SPEEDS, KE))


def test_lists_do_as_well_as_arrays(client):
    assert client.points(BLADE, CONTACT, [100.0], [1e3]).stable.tolist() == [1.0]
    assert client.map(BLADE, CONTACT, [100, 200], [1e3]).stable.shape == (1, 2)


def test_a_refusal_carries_the_problem(client):
    with pytest.raises(ServiceProblem, match=r"contact\.weights\.XX") as refused:
        client.points(BLADE, ContactConfiguration.at("XX"), SPEEDS, KE)
    assert refused.value.problem["status"] == 422
    assert refused.value.problem["field"] == "contact.weights.XX"
    assert pickle.loads(pickle.dumps(refused.value)).problem == refused.value.problem


def test_a_map_refused_is_a_problem_though_the_answer_was_to_be_npz(client):
    with pytest.raises(ServiceProblem) as refused:
        client.map(BLADE, CONTACT, np.full(100, 200.0), np.full(11, 1e12))
    assert refused.value.problem["status"] == 413 and refused.value.problem["field"] == "ke[0]"


def test_nan_is_refused_by_the_service_with_its_place(client):
    with pytest.raises(ServiceProblem) as refused:
        client.points(BLADE, CONTACT, SPEEDS, np.array([1.0, np.nan, 1.0]))
    assert refused.value.problem["field"] == "ke[1]"


def test_readiness_and_models(client):
    assert client.ready()
    assert isinstance(client.models(), list)


def test_no_service_is_a_problem_that_names_the_address():
    with Client("http://127.0.0.1:1", timeout=2.0, patience=ONCE) as client:
        assert not client.ready()
        with pytest.raises(ServiceProblem, match=r"127\.0\.0\.1:1") as refused:
            client.models()
    assert refused.value.problem["status"] is None


@pytest.mark.parametrize(
    ("status", "body"), [(502, b"<html>bad gateway</html>"), (200, b"<html>hello</html>"), (200, b"{}")]
)
def test_another_service_at_the_address_is_a_problem(status, body):
    transport = httpx.MockTransport(lambda request: httpx.Response(status, content=body))
    with Client("http://proxy.example", patience=ONCE, http=httpx.Client(transport=transport)) as client:
        with pytest.raises(ServiceProblem, match=r"proxy\.example"):
            client.models()
        with pytest.raises(ServiceProblem, match=r"proxy\.example"):
            client.map(BLADE, CONTACT, SPEEDS, KE)


def test_a_damaged_map_is_refused(screener):
    whole = replies.map_to_npz(screener.map(BLADE, CONTACT, SPEEDS, KE))
    for content in (b"", b"not a file", whole[: len(whole) // 2]):
        with pytest.raises(DamagedFile):
            replies.map_from_npz(content)
