"""Many points as npz and as Arrow: the same question and the same answer as in JSON."""

from __future__ import annotations

import io
import json
import zipfile

import numpy as np
import pyarrow as pa
import pytest
from bulk_bodies import FORMS, to_arrow, to_npz

from service.rest.forms.media_types import ARROW, JSON, NPZ
from service.rest.replies import points_from_dict

SPEEDS, KE = [100.0, 150.0, 200.0, 286.5], [1e3, 1e4, 2e4, 2e6]
COLUMNS = (
    "stable",
    "unstable_probability",
    "spectral_radius",
    "growth_per_revolution",
    "chatter_hz",
    "error_estimate",
    "unstable_multipliers",
    "wear_lobes",
)


def ask(http, form, body, accept=JSON, path="/v1/stability"):
    return http.post(path, content=body, headers={"Content-Type": form, "Accept": accept})


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("path", ["/v1/stability", "/v1/boundary", "/v1/sensitivities"])
def test_a_binary_question_is_answered_as_the_json_one(http, question, form, path):
    body = question(path, policy="exact")
    answer = ask(http, form, FORMS[form](body), path=path)
    assert answer.status_code == 200, answer.text
    assert answer.json() == http.post(path, json=body).json()


def test_a_map_is_asked_as_npz_and_not_as_a_table(http, question, problem):
    body = question("/v1/map", ke=[1e3, 2e6])
    answer = ask(http, NPZ, to_npz(body, compressed=True), path="/v1/map")
    assert answer.json() == http.post("/v1/map", json=body).json()
    refused = ask(http, ARROW, to_arrow(question()), path="/v1/map")
    assert NPZ in problem(refused, 415, "Content-Type")["remedy"]


def test_an_arrow_answer_has_the_columns_of_the_json_one_and_null_where_that_has_null(http, question):
    body = question(speed_hz=SPEEDS, ke=KE)
    plain = http.post("/v1/stability", json=body).json()
    answer = ask(http, ARROW, to_arrow(body, batch=3), ARROW)
    assert (answer.headers["content-type"], answer.headers["vary"]) == (ARROW, "Accept")
    table = pa.ipc.open_stream(answer.content).read_all()
    for name in (*COLUMNS, "source", "reason"):
        assert table[name].to_pylist() == plain[name], name
    assert pa.types.is_dictionary(table.schema.field("source").type)
    said = table.schema.metadata
    assert (said[b"rubscreen.model"].decode(), said[b"rubscreen.solver"].decode()) == ("rule-1", "rule")
    assert json.loads(said[b"rubscreen.certificate"]) == plain["certificate"]


def test_an_npz_answer_has_the_columns_of_the_json_one_and_nan_where_that_has_null(http, question):
    body = question(speed_hz=SPEEDS, ke=KE)
    plain = http.post("/v1/stability", json=body).json()
    expected = points_from_dict(plain, np.array(SPEEDS), np.array(KE))
    answer = ask(http, NPZ, to_npz(body), NPZ)
    assert answer.headers["content-type"] == NPZ
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as npz:
        for name in COLUMNS:
            np.testing.assert_array_equal(npz[name], getattr(expected, name), err_msg=name)
        for name in ("source", "reason"):
            assert npz[f"{name}_labels"][npz[name]].tolist() == plain[name]
        assert str(npz["model"]) == "rule-1" and json.loads(str(npz["certificate"])) == plain["certificate"]


@pytest.mark.parametrize("form", FORMS)
def test_a_bad_entry_of_a_binary_column_is_named_as_in_json(http, question, problem, form):
    for ke, field, value in (([1.0, np.nan], "ke[1]", "nan"), ([-1.0, 1.0], "ke[0]", "-1.0")):
        answer = ask(http, form, FORMS[form](question(), ke=np.array(ke)))
        assert problem(answer, 422, field)["value"] == value


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["float32", "int32", "uint8", ">f8", "int64"])
def test_numbers_of_every_kind_do(http, question, form, kind):
    ke = np.array([10, 100], dtype=kind if form == NPZ else kind.replace(">f8", "f8"))
    assert ask(http, form, FORMS[form](question(), ke=ke)).status_code == 200


@pytest.mark.parametrize("form", FORMS)
def test_more_points_than_the_service_takes_are_refused_in_every_form(http, question, problem, form):
    body = FORMS[form](question(speed_hz=[200.0] * 1001, ke=[1.0] * 1001))
    problem(ask(http, form, body), 413, "speed_hz")


@pytest.mark.parametrize(
    ("form", "columns", "field"),
    [
        (NPZ, {"ke": np.array([[1.0, 2.0]])}, "ke"),
        (NPZ, {"ke": np.array(["1", "2"])}, "ke"),
        (NPZ, {"ke": np.array([True, False])}, "body"),
        (NPZ, {"damping": np.zeros(2)}, "damping"),
        (NPZ, {"ke": np.array(1.0)}, "ke"),
        (ARROW, {"ke": pa.array(["1", "2"])}, "ke"),
        (ARROW, {"damping": np.zeros(2)}, "damping"),
        (ARROW, {"ke": pa.array([1.0, None])}, "ke[1]"),
        (ARROW, {"ke": pa.array([[1.0], [2.0]])}, "body"),
        (ARROW, {"ke": pa.array(["a", "a"]).dictionary_encode()}, "body"),
    ],
)
def test_a_column_that_is_not_one_row_of_numbers_is_named(http, question, problem, form, columns, field):
    problem(ask(http, form, FORMS[form](question(), **columns)), 422, field)


def test_an_array_given_twice_is_refused(http, question, problem):
    rest = question() | {"ke": [1.0, 1.0]}
    body = to_npz(question(), question=np.array(json.dumps({k: rest[k] for k in ("blade", "contact", "ke")})))
    assert problem(ask(http, NPZ, body), 422, "ke")["value"] == "given twice"


@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_an_npz_with_two_arrays_of_one_name_is_refused(http, question, problem):
    first, second = io.BytesIO(to_npz(question())), io.BytesIO()
    np.save(second, np.array([100.0]))
    with zipfile.ZipFile(first, "a") as archive:
        archive.writestr("speed_hz.npy", second.getvalue())
    assert problem(ask(http, NPZ, first.getvalue()), 422, "speed_hz")["value"] == "two arrays of one name"


@pytest.mark.parametrize(
    "said", [np.array("{"), np.array("[]"), np.array(3.0), np.array(["{}"]), np.array("\ud800")]
)
def test_a_question_that_is_no_json_object_is_refused(http, question, said):
    answer = ask(http, NPZ, to_npz(question(), question=said))
    assert answer.status_code == 422 and answer.json()["field"] in ("question", "body")


@pytest.mark.parametrize("path", ["/v1/stability", "/v1/boundary", "/v1/sensitivities", "/v1/map"])
@pytest.mark.parametrize(
    "kind",
    [
        "multipart/form-data; boundary=x",
        "application/octet-stream",
        "application/xml",
        "image/png",
        "application/vnd.apache.arrow.file",
        "json",
    ],
)
def test_a_body_of_another_form_is_refused_with_the_forms_there_are(http, question, problem, path, kind):
    answer = http.post(path, content=json.dumps(question(path)), headers={"Content-Type": kind})
    document = problem(answer, 415, "Content-Type")
    assert document["value"] == kind and JSON in document["remedy"] and NPZ in document["remedy"]


@pytest.mark.parametrize(
    "kind",
    [
        None,
        "",
        "application/json",
        "application/json; charset=utf-8",
        "Application/JSON",
        "text/json",
        "text/plain;charset=UTF-8",
        "application/vnd.mine+json",
        "application/x-www-form-urlencoded",
    ],
)
def test_json_is_taken_under_every_name_tools_send_it_by(http, question, kind):
    headers = {} if kind is None else {"Content-Type": kind}
    assert http.post("/v1/stability", content=json.dumps(question()), headers=headers).status_code == 200


def test_blades_are_sent_as_json_only(http, problem):
    problem(http.post("/v1/blades", content=b"", headers={"Content-Type": NPZ}), 415, "Content-Type")


@pytest.mark.parametrize("path", ["/v1/stability", "/v1/boundary", "/v1/sensitivities"])
def test_who_accepts_none_of_the_forms_still_gets_json(http, question, path):
    answer = http.post(path, json=question(path), headers={"Accept": "text/html"})
    assert answer.status_code == 200 and answer.headers["content-type"] == JSON
