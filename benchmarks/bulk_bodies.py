"""What a question of many points costs beside its answer: JSON, npz and Arrow in one run.

``python -m benchmarks.bulk_bodies [POINTS]``
"""

from __future__ import annotations

import io
import json
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import orjson
import pyarrow as pa

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from service.rest import replies
from service.rest.body import parsed
from service.rest.forms.arrow_question import METADATA_KEY, arrow_question
from service.rest.forms.arrow_replies import points_to_arrow
from service.rest.forms.npz_question import npz_question
from service.rest.forms.npz_replies import points_from_npz, points_to_npz
from service.rest.questions import PointsQuestion
from service.settings import Settings
from training.screening import Screener

REPEATS = 3


def main(points: int = 250_000) -> None:
    """Print milliseconds (best of three) and bytes of each step."""
    rng = np.random.default_rng(6)
    blade, contact = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE", "TE")
    speed, ke = rng.uniform(60.0, 300.0, points), rng.uniform(0.0, 2.5e4, points)
    rest = {"blade": blade_to_dict(blade), "contact": contact.to_dict(), "policy": "surrogate"}
    said = json.dumps(rest)

    def as_json() -> bytes:
        return orjson.dumps(rest | {"speed_hz": speed, "ke": ke}, option=orjson.OPT_SERIALIZE_NUMPY)

    def as_npz() -> bytes:
        buffer = io.BytesIO()
        np.savez(buffer, question=np.array(said), speed_hz=speed, ke=ke)
        return buffer.getvalue()

    def as_arrow() -> bytes:
        table = pa.table({"speed_hz": speed, "ke": ke}).replace_schema_metadata({METADATA_KEY: said})
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table)
        return sink.getvalue().to_pybytes()

    settings, screener = Settings(max_points=points, max_body_bytes=2**30), Screener.default()
    readers: dict[str, Callable] = {
        "JSON": lambda body: parsed(body),
        "npz": lambda body: npz_question(body, settings),
        "Arrow": lambda body: arrow_question(body, settings),
    }
    writers: dict[str, Callable] = {
        "JSON": lambda found: replies.to_json(replies.points_to_dict(found)),
        "npz": points_to_npz,
        "Arrow": points_to_arrow,
    }
    takers: dict[str, Callable] = {
        "JSON": lambda reply: replies.points_from_dict(orjson.loads(reply), speed, ke),
        "npz": lambda reply: points_from_npz(reply, speed, ke),
        "Arrow": lambda reply: pa.ipc.open_stream(reply).read_all(),
    }
    for policy in ("surrogate", "auto"):
        spent, found = timed(partial(screener.points, blade, contact, speed, ke, policy), 1)
        print(
            f"{points:,} points under {policy}: answered in {spent:.0f} ms, {found.exact_share:.2%} exactly"
        )
        print("form    write   parse  serialise   read [ms]     question       answer [bytes]")
        for name, write in (("JSON", as_json), ("npz", as_npz), ("Arrow", as_arrow)):
            writing, body = timed(write)
            read = readers[name]
            parsing, _ = timed(lambda r=read, b=body: PointsQuestion.read(r(b), settings))
            serialising, reply = timed(partial(writers[name], found))
            reading, _ = timed(partial(takers[name], reply))
            print(
                f"{name:6}{writing:7.0f} {parsing:7.0f} {serialising:10.0f} {reading:6.0f}"
                f"       {len(body):12,} {len(reply):12,}"
            )


def timed(work: Callable[[], Any], repeats: int = REPEATS) -> tuple[float, Any]:
    """Milliseconds of the fastest run, and its outcome."""
    best, outcome = np.inf, None
    for _ in range(repeats):
        began = time.perf_counter()
        outcome = work()
        best = min(best, time.perf_counter() - began)
    return best * 1e3, outcome


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
