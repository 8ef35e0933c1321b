"""One call answers all of it, and says what the blade does not tell."""

from __future__ import annotations

import json

import pytest
from named_problems import AT_TIP, one_mode

from sdm_core.assessment import OperatingPoint, Uncertainty, assess
from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput

LE = ContactConfiguration.at("LE")


@pytest.fixture(scope="module")
def rotor_37():
    seen = []
    found = assess(
        example_blade("nasa_rotor_37"),
        LE,
        (150.0, 300.0),
        ke_liner=9500.0,
        cold_clearance_m=4e-4,
        points=[OperatingPoint("cruise", 241.6, 0.8), OperatingPoint("idle", 160.0, 0.2)],
        uncertainty=Uncertainty(per_mode=False),
        progress=lambda what, done, of: seen.append((what, done, of)),
    )
    return found, seen


def test_parts_of_an_assessment_tell_one_story(rotor_37):
    found, _ = rotor_37
    assert found.worst.ke == found.margins.worst.ke == found.edges.leading.tip.ke
    assert found.robust_range.nominal.ke == pytest.approx(found.worst.ke, rel=2e-4)
    assert found.owners[0].tip is found.tips[0]
    assert {point.tip for point in found.campbell.lobe_points} == set(found.tips)
    critical = {m.mode: m.critical_ke for m in found.modes if m.critical_ke}
    assert found.owners[0].mode == min(critical, key=critical.get)
    cruise = found.margins.points[0]
    assert found.robust_points.nominal.ke == pytest.approx(
        min(p.critical_ke for p in found.margins.points if p.critical_ke), rel=1e-9
    )
    assert cruise.stable is False and found.margins.unstable_time_share == pytest.approx(0.8)


def test_an_assessment_is_strict_json(rotor_37):
    found, _ = rotor_37
    text = json.dumps(found.to_dict(), allow_nan=False)
    back = json.loads(text)
    assert back["worst"]["ke"] == found.worst.ke
    assert back["edges"]["safer"] == "TE"
    assert back["margins"]["unstable_time_share"] == pytest.approx(0.8)
    assert back["robust_range"]["worst"]["described"] == found.robust_range.worst.described
    assert [kind["label"] for kind in back["kinds"]] == ["1B", "1T", "2B", "1C", "2T"]


def test_progress_names_every_part_and_their_number(rotor_37):
    _, seen = rotor_37
    assert [done for _, done, _ in seen] == list(range(8))
    assert {of for *_, of in seen} == {8}


def test_what_a_blade_does_not_tell_is_said(rotor_37):
    found, _ = rotor_37
    assert any("tip_growth_m" in said for said in found.missing)
    bare = assess(one_mode(4e-3, 100.0, 2.0), AT_TIP, (15.0, 50.0), robust=False)
    assert bare.edges is None and bare.margins is None and bare.kinds == ()
    said = " ".join(bare.missing)
    for word in ("tip_nodes", "ke_liner", "cold_clearance_m"):
        assert word in said
    json.dumps(bare.to_dict(), allow_nan=False)


def test_an_unusable_question_is_refused_before_any_work():
    blade = example_blade("nasa_rotor_37")
    with pytest.raises(InvalidInput, match="low_hz"):
        assess(blade, LE, (300.0, 150.0))
    with pytest.raises(InvalidInput, match="ke_liner"):
        assess(blade, LE, (150.0, 300.0), ke_liner=-1.0)
    with pytest.raises(InvalidInput, match="ke_max"):
        assess(blade, LE, (150.0, 300.0), ke_liner=9e3, ke_max=5e3)
