"""Every bad input is refused with a problem document that names field, value and remedy."""

from __future__ import annotations

import json

import pytest

DELETE = object()


def _with(body: dict, path: list, value: object) -> str:
    *parents, last = path
    target = body
    for part in parents:
        target = target[part]
    if value is DELETE:
        del target[last]
    else:
        target[last] = value
    return json.dumps(body)


NAN, INFINITY = float("nan"), float("inf")
STATE = ["blade", "states", 0]

BAD_BLADES = {
    "a negative frequency": ([*STATE, "frequency_hz", 1], -5.0, "blade.states[0].frequency_hz[1]", "-5.0"),
    "a frequency of zero": ([*STATE, "frequency_hz", 0], 0, "blade.states[0].frequency_hz[0]", "0"),
    "a frequency that is NaN": ([*STATE, "frequency_hz", 2], NAN, "blade.states[0].frequency_hz[2]", "nan"),
    "a frequency of 1e300": ([*STATE, "frequency_hz", 0], 1e300, "blade.states[0].frequency_hz[0]", "1e+300"),
    "a boolean frequency": ([*STATE, "frequency_hz", 0], True, "blade.states[0].frequency_hz[0]", "True"),
    "a frequency as text": ([*STATE, "frequency_hz", 0], "906", "blade.states[0].frequency_hz[0]", "906"),
    "no frequencies": ([*STATE, "frequency_hz"], [], "blade.states[0].frequency_hz", "[]"),
    "frequencies by name": ([*STATE, "frequency_hz"], {"f1": 906}, "blade.states[0].frequency_hz", "906"),
    "a negative state speed": ([*STATE, "speed_hz"], -1.0, "blade.states[0].speed_hz", "-1.0"),
    "ragged mode shapes": (
        [*STATE, "mode_shape", 1],
        [1.0, 2.0],
        "blade.states[0].mode_shape[1]",
        "row of 2",
    ),
    "a mode shape too few": (
        [*STATE, "mode_shape"],
        [[1.0, 2.0, 3.0]],
        "blade.states[0].mode_shape",
        "1 rows",
    ),
    "a mode shape without rows": ([*STATE, "mode_shape"], 7, "blade.states[0].mode_shape", "7"),
    "an infinite amplitude": (
        [*STATE, "mode_shape", 0, 0],
        INFINITY,
        "blade.states[0].mode_shape[0][0]",
        "inf",
    ),
    "no mode shape": ([*STATE, "mode_shape"], DELETE, "blade.states[0].mode_shape", "missing"),
    "damping of one": (["blade", "damping_ratio"], 1.0, "blade.damping_ratio", "1.0"),
    "negative damping": (["blade", "damping_ratio"], [1e-3, -1e-3, 1e-3], "blade.damping_ratio[1]", "-0.001"),
    "damping for too few modes": (["blade", "damping_ratio"], [1e-3], "blade.damping_ratio", "1 numbers"),
    "damping as a boolean": (["blade", "damping_ratio"], False, "blade.damping_ratio", "False"),
    "no states": (["blade", "states"], [], "blade.states", "[]"),
    "a state that is no object": (["blade", "states", 0], 3, "blade.states[0]", "3"),
    "another schema": (["blade", "schema"], "rubscreen/blade/2", "blade.schema", "rubscreen/blade/2"),
    "no schema": (["blade", "schema"], DELETE, "blade.schema", "missing"),
    "an unknown direction": (["blade", "direction"], "axial", "blade.direction", "axial"),
    "two nodes of one name": (["blade", "tip_nodes", 1], "LE", "blade.tip_nodes[1]", "LE"),
    "nodes as an object": (["blade", "tip_nodes"], {"LE": 1, "N5": 2, "TE": 3}, "blade.tip_nodes", "LE"),
    "a blade without a name": (["blade", "name"], "", "blade.name", "''"),
    "a blade that is a list": (["blade"], [1, 2], "blade", "[1, 2]"),
    "no blade": (["blade"], DELETE, "blade", "missing"),
    "no tip nodes": (["blade", "tip_nodes"], DELETE, "blade.tip_nodes", "missing"),
}
BAD_CONTACTS = {
    "an unknown node": (["contact", "weights"], {"N99": 1.0}, "contact.weights.N99", "1.0"),
    "a negative weight": (["contact", "weights", "LE"], -1.0, "contact.weights.LE", "-1.0"),
    "no weight above zero": (["contact", "weights"], {"LE": 0.0}, "contact.weights", "0.0"),
    "empty weights": (["contact", "weights"], {}, "contact.weights", "{}"),
    "weights as a list": (["contact", "weights"], [1.0], "contact.weights", "[1.0]"),
    "no weights": (["contact", "weights"], DELETE, "contact.weights", "missing"),
    "an unknown key": (["contact", "arc"], [[0, 0.5]], "contact.arc", "[[0, 0.5]]"),
    "empty arcs": (["contact", "arcs"], [], "contact.arcs", "[]"),
    "unsorted arcs": (["contact", "arcs"], [[0.5, 0.75], [0.0, 0.25]], "contact.arcs[1]", "[0.0, 0.25]"),
    "overlapping arcs": (["contact", "arcs"], [[0.0, 0.5], [0.4, 0.75]], "contact.arcs[1]", "[0.4, 0.75]"),
    "arcs overlapping past 1": (
        ["contact", "arcs"],
        [[0.1, 0.5], [0.9, 1.2]],
        "contact.arcs[1]",
        "[0.9, 1.2]",
    ),
    "an arc that ends before it starts": (["contact", "arcs"], [[0.5, 0.25]], "contact.arcs[0][1]", "0.25"),
    "an arc with one end": (["contact", "arcs"], [[0.5]], "contact.arcs[0]", "[0.5]"),
    "an arc of NaN": (["contact", "arcs"], [[NAN, 0.5]], "contact.arcs[0][0]", "nan"),
    "engagement as a number": (["contact", "engagement"], 0.5, "contact.engagement", "0.5"),
    "engagement without a mean": (["contact", "engagement"], {}, "contact.engagement.mean", "missing"),
    "engagement below zero": (
        ["contact", "engagement"],
        {"mean": 0.3, "cosine": [0.4]},
        "contact.engagement",
        "γ down to -0.1",
    ),
    "an engagement of NaN": (
        ["contact", "engagement"],
        {"mean": 0.5, "sine": [NAN]},
        "contact.engagement.sine[0]",
        "nan",
    ),
    "contact as text": (["contact"], "LE", "contact", "LE"),
    "no contact": (["contact"], DELETE, "contact", "missing"),
}
BAD_POINTS = {
    "a speed of zero": (["speed_hz", 0], 0, "speed_hz[0]", "0"),
    "a negative speed": (["speed_hz", 1], -286.5, "speed_hz[1]", "-286.5"),
    "an infinite speed": (["speed_hz", 1], INFINITY, "speed_hz[1]", "inf"),
    "a speed of 1e300": (["speed_hz", 0], 1e300, "speed_hz[0]", "1e+300"),
    "a speed as text": (["speed_hz", 0], "180", "speed_hz[0]", "180"),
    "a speed of null": (["speed_hz", 0], None, "speed_hz[0]", "None"),
    "no speeds": (["speed_hz"], [], "speed_hz", "[]"),
    "one speed outside a list": (["speed_hz"], 180.0, "speed_hz", "180.0"),
    "a nested speed": (["speed_hz", 0], [180.0], "speed_hz[0]", "[180.0]"),
    "a stiffness of NaN": (["ke", 1], NAN, "ke[1]", "nan"),
    "a stiffness of 1e300": (["ke", 1], 1e300, "ke[1]", "1e+300"),
    "a stiffness of 400 digits": (["ke", 1], 10**400, "ke[1]", "1000"),
    "a negative stiffness": (["ke", 0], -1.0, "ke[0]", "-1.0"),
    "a boolean stiffness": (["ke", 0], True, "ke[0]", "True"),
    "no stiffnesses": (["ke"], [], "ke", "[]"),
    "fewer stiffnesses than speeds": (["ke"], [1e3], "ke", "1 numbers"),
    "an unknown policy": (["policy"], "fast", "policy", "fast"),
    "a policy in capitals": (["policy"], "AUTO", "policy", "AUTO"),
    "a policy of null": (["policy"], None, "policy", "None"),
    "a policy in a list": (["policy"], ["auto"], "policy", "auto"),
    "an unknown field": (["polcy"], "exact", "polcy", "exact"),
    "no speeds at all": (["speed_hz"], DELETE, "speed_hz", "missing"),
    "no stiffnesses at all": (["ke"], DELETE, "ke", "missing"),
}
BAD = BAD_BLADES | BAD_CONTACTS | BAD_POINTS


@pytest.mark.parametrize("name", BAD)
def test_a_bad_field_is_named_with_its_value_and_a_remedy(http, question, problem, name):
    path, value, field, found = BAD[name]
    answer = http.post("/v1/stability", content=_with(question(), path, value))
    document = problem(answer, 422, field)
    assert found in document["value"]


@pytest.mark.parametrize("path", ["/v1/boundary", "/v1/map"])
@pytest.mark.parametrize("name", [*BAD_BLADES, *BAD_CONTACTS])
def test_blade_and_contact_are_checked_alike_on_every_path(http, question, problem, path, name):
    keys, value, field, _ = BAD[name]
    problem(http.post(path, content=_with(question(path), keys, value)), 422, field)


@pytest.mark.parametrize("ke_max", [0, -1.0, NAN, INFINITY, 1e300, "1e5", True, None, [1e5]])
def test_a_boundary_needs_a_positive_largest_stiffness(http, question, problem, ke_max):
    body = json.dumps(question("/v1/boundary") | {"ke_max": ke_max})
    problem(http.post("/v1/boundary", content=body), 422, "ke_max")


NOT_JSON = {
    "nothing": (b"", "empty"),
    "white space": (b"  \n", "empty"),
    "text": (b"hello", "hello"),
    "a truncated object": (b'{"blade": {"schema": "rubscreen/blade/1", ', "ends at"),
    "a truncated text": (b'{"blade": {"schema": "rubscr', "rubscr"),
    "two objects": (b"{} {}", "{} {}"),
    "single quotes": (b"{'blade': 1}", "blade"),
    "a trailing comma": (b'{"ke": [1, 2,]}', "]}"),
    "a wrong encoding": ("é".encode("latin-1"), "byte 0xe9"),
    "compressed bytes": (b"\x1f\x8b\x08\x00", "byte 0x8b"),
    "a list": (b"[]", "[]"),
    "a number": (b"3", "3"),
    "a text value": (b'"blade"', "blade"),
    "null": (b"null", "None"),
    "NaN alone": (b"NaN", "nan"),
    "deep lists": (b"[" * 50_000 + b"]" * 50_000, "nested"),
    "lists of fifty levels": (b'{"blade":' + b"[" * 50 + b"]" * 50 + b"}", "nested"),
    "deep objects": (b'{"a":' * 5_000 + b"1" + b"}" * 5_000, "nested"),
    "an integer of 5000 digits": (b'{"ke": [' + b"1" * 5000 + b"]}", "digits"),
    "half a surrogate pair": (b'{"blade": {"name": "\\ud800"}}', "\\ud800"),
}


@pytest.mark.parametrize("name", NOT_JSON)
@pytest.mark.parametrize("path", ["/v1/stability", "/v1/map"])
def test_a_body_that_is_not_one_json_object_is_refused(http, problem, path, name):
    body, found = NOT_JSON[name]
    assert found in problem(http.post(path, content=body), 422, "body")["value"]


@pytest.mark.parametrize("place", ["speed_hz", "blade.damping_ratio", "blade.states[0].speed_hz"])
def test_a_member_named_twice_is_refused_and_not_left_to_chance(http, question, problem, place):
    name = place.rpartition(".")[2]
    body = json.dumps(question())
    if place == "speed_hz":
        body = body[:-1] + ', "speed_hz": [100.0]}'
    else:
        body = body.replace(f'"{name}":', f'"{name}": 0.5, "{name}":', 1)
    document = problem(http.post("/v1/stability", content=body), 422, place)
    assert document["value"] == "given twice"


def test_a_byte_order_mark_and_any_content_type_are_no_obstacle(http, question):
    body = b"\xef\xbb\xbf" + json.dumps(question()).encode()
    assert http.post("/v1/stability", content=body, headers={"Content-Type": "text/plain"}).status_code == 200


def test_the_surrogate_alone_outside_its_domain_is_refused(http, question, problem):
    body = question(ke=[1e3, 2e6], policy="surrogate")
    assert "domain" in problem(http.post("/v1/stability", json=body), 422, "ke")["remedy"]


def test_a_path_that_is_not_there_is_a_problem(http, problem):
    assert "/docs" in problem(http.get("/v2/map"), 404, "path")["remedy"]
    problem(http.post("/v1/map/", json={}), 404, "path")


@pytest.mark.parametrize(
    ("method", "path"), [("GET", "/v1/map"), ("DELETE", "/v1/models"), ("POST", "/healthz")]
)
def test_a_method_the_path_does_not_take_is_a_problem(http, problem, method, path):
    answer = http.request(method, path)
    assert answer.headers["allow"] in problem(answer, 405, "method")["remedy"]


def test_a_fault_of_the_service_is_a_problem_without_its_insides(own_http, screener, question, problem):
    screener.critical = "broken"
    document = problem(own_http.post("/v1/stability", json=question()), 500, "service")
    assert "Traceback" not in json.dumps(document)
