"""Questions of any size: divided, sent as npz, put together again, by one model."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace

import httpx
import numpy as np
import pytest

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from service.app import create_app
from service.client import AsyncClient, Client, Patience, ServiceProblem, progress_bar
from service.client.questions import Boundary, Map, Points, Sensitivities
from service.rest.forms.media_types import JSON, NPZ
from service.settings import Settings

BLADE = example_blade("nasa_rotor_37")
CONTACT = ContactConfiguration.at("LE", "TE")
ONCE = Patience(attempts=1)
RNG = np.random.default_rng(6)


def same(found, expected) -> None:
    for name in expected.__dataclass_fields__:
        a, b = getattr(found, name), getattr(expected, name)
        if isinstance(b, np.ndarray):
            np.testing.assert_array_equal(a, b, err_msg=name)
        else:
            assert a == b, name


@dataclass
class Awaited:
    """An `AsyncClient` whose methods are awaited at once, one connection each."""

    url: str

    def __getattr__(self, name):
        async def there(*args, **options):
            async with AsyncClient(self.url, patience=ONCE) as client:
                return await getattr(client, name)(*args, **options)

        return lambda *args, **options: asyncio.run(there(*args, **options))


@pytest.fixture
def address(serving, screener):
    settings = Settings(max_points=10_000, max_boundary_speeds=100)
    with serving(create_app(settings, screener=screener)) as url:
        yield url


@pytest.fixture(params=["sync", "async"])
def client(request, address):
    if request.param == "async":
        yield Awaited(address)
    else:
        with Client(address, patience=ONCE) as made:
            yield made


def test_points_of_any_number_are_answered_in_order(client, screener):
    speed, ke = RNG.uniform(100.0, 280.0, 37_003), RNG.uniform(0.0, 2e6, 37_003)
    told = []
    found = client.points(BLADE, CONTACT, speed, ke, progress=lambda done, of: told.append((done, of)))
    same(found, screener.points(BLADE, CONTACT, speed, ke))
    assert told[-1] == (37_003, 37_003) and len(told) >= 4 and sorted(told) == told


@pytest.mark.parametrize("shape", [(300, 70), (2, 15_000), (1, 25_000), (25_000, 1)])
def test_a_map_of_any_shape_is_answered_as_one(client, screener, shape):
    speed, ke = np.linspace(100.0, 280.0, shape[0]), np.linspace(0.0, 2e6, shape[1])
    same(client.map(BLADE, CONTACT, speed, ke), screener.map(BLADE, CONTACT, speed, ke))


def test_boundaries_and_sensitivities_at_any_number_of_speeds(client, screener):
    speed = np.linspace(100.0, 280.0, 730)
    for policy in ("auto", "exact"):
        asked = (BLADE, CONTACT, speed, 1e5, policy)
        same(client.boundary(*asked), screener.boundary(*asked))
        same(client.sensitivities(*asked), screener.sensitivities(*asked))


def test_an_entry_that_is_refused_is_named_by_its_place_in_the_whole(client):
    speed, ke = np.full(30_000, 200.0), np.ones(30_000)
    ke[29_123] = np.nan
    with pytest.raises(ServiceProblem, match=r"^ke\[29123\] = nan") as refused:
        client.points(BLADE, CONTACT, speed, ke)
    assert refused.value.problem["field"] == "ke[29123]"
    with pytest.raises(ServiceProblem, match=r"^speed_hz\[29999\]"):
        client.map(BLADE, CONTACT, np.append(speed[1:], 1e-5), [1.0])
    with pytest.raises(ServiceProblem, match=r"^ke\[29123\]"):
        client.map(BLADE, CONTACT, [200.0], ke)


def test_arrays_of_different_length_are_not_divided(client):
    with pytest.raises(ServiceProblem) as refused:
        client.points(BLADE, CONTACT, np.full(5000, 200.0), np.ones(4999))
    assert refused.value.problem["field"] == "ke"


def test_what_is_too_large_but_not_by_its_points_is_not_divided(client):
    big = replace(BLADE, name="b" * 500)
    with pytest.raises(ServiceProblem) as refused:
        client.points(big, CONTACT, np.full(5000, 200.0), np.ones(5000))
    assert refused.value.problem["field"] == "blade.name"


@pytest.mark.parametrize(
    "question",
    [
        Points(BLADE, CONTACT, np.ones(250_001), "auto", None, np.ones(250_001)),
        Map(BLADE, CONTACT, np.ones(701), "auto", None, np.ones(701)),
        Boundary(BLADE, CONTACT, np.ones(12_001), "auto", None, 1.0),
        Sensitivities(BLADE, CONTACT, np.ones(12_001), "auto", None, 1.0),
    ],
)
def test_parts_are_within_the_limits_of_a_service_as_it_comes(question):
    limits = Settings()
    most = limits.max_boundary_speeds if isinstance(question, Boundary) else limits.max_points
    parts = question.parts()
    assert sum(part.size for part in parts) == question.size
    assert all(part.size <= most and len(part.message().content) < limits.max_body_bytes for part in parts)


def test_a_small_question_is_json_and_a_large_one_npz():
    for count, form in ((100, JSON), (5000, NPZ)):
        message = Points(BLADE, CONTACT, np.ones(count), "auto", None, np.ones(count)).message()
        assert (message.form, message.accept) == (form, form)


def through(answer, **options) -> Client:
    return Client("http://x", http=httpx.Client(transport=httpx.MockTransport(answer)), **options)


def rule_answer(request, screener):
    """As a service that reads npz would, without one."""
    from service.rest.forms.npz_question import npz_question
    from service.rest.forms.npz_replies import points_to_npz

    asked = npz_question(request.content, Settings())
    found = screener.points(BLADE, CONTACT, asked["speed_hz"], asked["ke"])
    return httpx.Response(200, content=points_to_npz(found), headers={"content-type": NPZ})


def test_a_service_that_knows_no_npz_is_sent_json(serving, screener):
    speed, ke = np.full(3000, 200.0), RNG.uniform(0.0, 2e6, 3000)
    with serving(create_app(screener=screener)) as url, httpx.Client(base_url=url) as http:

        def older(request):
            if request.headers["content-type"] == NPZ:
                document = {"status": 422, "field": "body", "detail": "send JSON"}
                return httpx.Response(
                    422, json=document, headers={"content-type": "application/problem+json"}
                )
            reply = http.post(request.url.path, content=request.content)
            return httpx.Response(reply.status_code, content=reply.content)

        with through(older) as client:
            same(client.points(BLADE, CONTACT, speed, ke), screener.points(BLADE, CONTACT, speed, ke))


def test_every_part_comes_from_the_model_that_answered_last(screener):
    speed, ke, asked = np.full(250_000, 200.0), RNG.uniform(0.0, 2e6, 250_000), []

    def changing(request):
        asked.append(request)
        screener.model_id = "old" if len(asked) <= 2 else "new"
        return rule_answer(request, screener)

    with through(changing) as client:
        found = client.points(BLADE, CONTACT, speed, ke)
    assert found.model == "new" and len(asked) == 3 + 4
    same(found, screener.points(BLADE, CONTACT, speed, ke))


def test_a_model_that_changes_all_the_time_is_a_problem(screener):
    speed, ke, asked = np.full(250_000, 200.0), np.ones(250_000), []

    def changing(request):
        asked.append(request)
        screener.model_id = f"model-{len(asked)}"
        return rule_answer(request, screener)

    with through(changing) as client, pytest.raises(ServiceProblem, match="changed"):
        client.points(BLADE, CONTACT, speed, ke)
    assert len(asked) < 10


def test_an_answer_of_another_length_is_not_believed(screener):
    def short(request):
        found = screener.points(BLADE, CONTACT, np.ones(2), np.ones(2))
        from service.rest.forms.npz_replies import points_to_npz

        return httpx.Response(200, content=points_to_npz(found), headers={"content-type": NPZ})

    with through(short) as client, pytest.raises(ServiceProblem, match="not from rubscreen"):
        client.points(BLADE, CONTACT, np.ones(3000), np.ones(3000))


def test_a_progress_bar_takes_what_a_question_tells():
    with progress_bar("points") as progress:
        progress(1, 2)
        progress(2, 2)


def test_a_blade_is_checked_and_built(client):
    checked = client.check_blade(BLADE)
    assert checked.blade.name == BLADE.name and checked.build is None
    with pytest.raises(ServiceProblem):
        client.model("none")
