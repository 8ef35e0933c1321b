"""``/v1/campbell``, ``/v1/lobes``, ``/v1/damping``, and what a design tool begins with."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from sdm_core.assessment.campbell import campbell_diagram
from sdm_core.assessment.margins import margins
from sdm_core.assessment.needed_damping import needed_damping
from sdm_core.blade import blade_from_dict, blade_to_dict, example_blade
from sdm_core.blade.profile import profile_from_dict
from sdm_core.blade.profile.shape_change import ShapeChange
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke
from service.rest.assessment_questions import CAMPBELL_EXAMPLE, DAMPING_EXAMPLE, LOBES_EXAMPLE
from service.rest.assessment_schemas import CampbellReply, DampingReply, LobesReply
from service.rest.profile_schema import BLADES_EXAMPLE
from service.rest.question_schemas import MAP_EXAMPLE

BLADE = example_blade("nasa_rotor_37")
DOCUMENT = blade_to_dict(BLADE)
LE = ContactConfiguration.at("LE")
SPAN = (150.0, 300.0)
ASKED = {"blade": DOCUMENT, "contact": {"weights": {"LE": 1.0}}, "speed_range_hz": list(SPAN)}


def answered(http, path: str, body: dict) -> dict:
    reply = http.post(path, json=body)
    assert reply.status_code == 200, reply.text
    return reply.json()


@pytest.mark.parametrize(
    ("path", "example", "reply"),
    [
        ("/v1/campbell", CAMPBELL_EXAMPLE, CampbellReply),
        ("/v1/lobes", LOBES_EXAMPLE, LobesReply),
        ("/v1/damping", DAMPING_EXAMPLE, DampingReply),
    ],
)
def test_the_examples_of_the_documentation_are_answered_in_their_schemas(http, path, example, reply):
    reply.model_validate(answered(http, path, example), strict=True)


def test_the_campbell_diagram_is_that_of_the_core(http):
    found = answered(
        http, "/v1/campbell", {"blade": DOCUMENT, "speed_range_hz": [60, 300], "engine_orders": [4]}
    )
    core = campbell_diagram(BLADE, (60.0, 300.0), engine_orders=[4])
    assert np.array_equal(found["frequency_hz"], core.frequency_hz)
    assert [(c["order"], c["mode"], c["speed_hz"]) for c in found["crossings"]] == [
        (c.order, c.mode, c.speed_hz) for c in core.crossings
    ]


def test_the_deepest_lobes_come_first_with_their_modes_and_the_unstable_speeds(http):
    found = answered(http, "/v1/lobes", {**ASKED, "ke_max": 2.5e4, "count": 3, "ke_liner": 1.2e4})
    tips = least_critical_ke(BLADE, LE, *SPAN, 2.5e4, count=3)
    assert [lobe["tip"]["ke"] for lobe in found["lobes"]] == [tip.ke for tip in tips]
    assert all(abs(sum(lobe["participation"]) - 1) < 1e-9 for lobe in found["lobes"])
    core = margins(BLADE, LE, SPAN, 1.2e4, ke_max=2.5e4)
    assert found["unstable_speeds_hz"] == [[one.low_hz, one.high_hz] for one in core.unstable]
    assert found["proven"] and 0 < found["unstable_share"] < 1


def test_the_damping_named_is_that_of_the_core_and_meets_the_stiffness(http):
    found = answered(http, "/v1/damping", {**ASKED, "ke": 1.5e4})
    assert found["factor"] == needed_damping(BLADE, LE, SPAN, 1.5e4).factor
    damped = DOCUMENT | {"damping_ratio": found["damping_ratio"]}
    (least,) = least_critical_ke(blade_from_dict(damped), LE, *SPAN, 2.5e4, count=1)
    assert 1.5e4 <= least.ke <= 1.5e4 * (1 + 2e-3)


@pytest.mark.parametrize(
    ("path", "change", "field"),
    [
        ("/v1/campbell", {"speed_range_hz": [300, 60]}, "speed_range_hz"),
        ("/v1/campbell", {"speed_range_hz": [60]}, "speed_range_hz"),
        ("/v1/campbell", {"speed_range_hz": [60, 1000]}, "speed_range_hz[1]"),
        ("/v1/campbell", {"engine_orders": [0]}, "engine_orders[0]"),
        ("/v1/lobes", {"speed_range_hz": [60, 1000]}, "speed_range_hz[1]"),
        ("/v1/lobes", {"count": 0}, "count"),
        ("/v1/lobes", {"count": True}, "count"),
        ("/v1/lobes", {"ke_liner": 3e4}, "ke_liner"),
        ("/v1/lobes", {"ke_max": -1}, "ke_max"),
        ("/v1/lobes", {"contact": {"weights": {"nowhere": 1}}}, "contact.weights.nowhere"),
        ("/v1/damping", {"ke": 0}, "ke"),
        ("/v1/damping", {"ke": 9e7}, "ke"),
        ("/v1/damping", {"blade": DOCUMENT | {"damping_ratio": 0}}, "blade.damping_ratio"),
        ("/v1/damping", {"keh": 1}, "keh"),
    ],
)
def test_what_cannot_be_used_is_named_with_its_remedy(http, problem, path, change, field):
    usual = {"/v1/campbell": {}, "/v1/lobes": {"ke_max": 2.5e4}, "/v1/damping": {"ke": 1e4}}[path]
    asked = ({"blade": DOCUMENT, "speed_range_hz": [60, 300]} if path == "/v1/campbell" else ASKED) | usual
    reply = http.post(path, json=asked | change)
    assert reply.status_code in (413, 422), reply.text
    assert reply.json()["field"].startswith(field) and reply.json()["remedy"]


def test_a_map_answers_with_the_arrays_that_were_asked_for(http, problem):
    whole = answered(http, "/v1/map", MAP_EXAMPLE)
    part = answered(http, "/v1/map", MAP_EXAMPLE | {"fields": ["stable"]})
    assert part["stable"] == whole["stable"] and part["exact_share"] == whole["exact_share"]
    assert set(whole) - set(part) == {"unstable_probability", "source", "reason"}
    reply = http.post(
        "/v1/map", json=MAP_EXAMPLE | {"fields": ["source"]}, headers={"Accept": "application/x-npz"}
    )
    with np.load(io.BytesIO(reply.content)) as npz:
        assert set(npz) == {"speed_hz", "ke", "source", "model", "solver", "certificate"}
        assert npz["source"].tolist() == whole["source"]
    problem(http.post("/v1/map", json=MAP_EXAMPLE | {"fields": ["stabel"]}), 422, "fields[0]")
    problem(http.post("/v1/map", json=MAP_EXAMPLE | {"fields": []}), 422, "fields")


def test_the_examples_that_a_tool_begins_with_can_be_used(http):
    found = http.get("/v1/examples").json()
    assert found["blades"]["nasa_rotor_37"] == DOCUMENT
    assert profile_from_dict(found["profiles"]["transonic_profile"]).name == "transonic-example"
    shown = Path(__file__).parents[2] / "examples" / "transonic_blade_profile.json"
    assert found["profiles"]["transonic_profile"] == json.loads(shown.read_text())


def test_whoever_asks_without_keys_may_do_everything(http):
    assert http.get("/v1/caller").json() == {"name": "anonymous", "role": "admin", "key_id": None}


def test_a_profile_is_built_with_its_shape_changed(http, problem):
    asked = BLADES_EXAMPLE | {"verify": False}
    plain = answered(http, "/v1/blades", asked)["blade"]
    thick = answered(http, "/v1/blades", asked | {"shape_change": {"thickness": 1.1}})["blade"]
    # The first flap of a plate goes with its thickness.
    assert thick["states"][0]["frequency_hz"][0] / plain["states"][0]["frequency_hz"][0] == pytest.approx(
        1.1, rel=0.03
    )
    profile = profile_from_dict(asked["profile"])
    assert ShapeChange(thickness=1.1).of_profile(profile).name == profile.name
    problem(
        http.post("/v1/blades", json=asked | {"shape_change": {"thickness": 9}}),
        422,
        "shape_change.thickness",
    )
    problem(http.post("/v1/blades", json=asked | {"shape_change": {"lean": 1}}), 422, "shape_change.lean")
    problem(
        http.post("/v1/blades", json={"blade": DOCUMENT, "shape_change": {"lean_deg": 1}}),
        422,
        "shape_change",
    )
