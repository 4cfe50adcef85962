"""A flight log as an MCAP file that viewers such as Foxglove play: one pose and one state topic a robot, as JSON."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from flight.logs.large_logs import lightened
from flight.logs.log import FlightLog
from flight.model.attitude import from_euler
from verify.data import MissingEngine

_POSE = {
    "title": "foxglove.PoseInFrame",
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "frame_id": {"type": "string"},
        "pose": {
            "type": "object",
            "properties": {
                "position": {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyz"}},
                "orientation": {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyzw"}},
            },
        },
    },
}
_STATE = {
    "title": "ltlplan.State",
    "type": "object",
    "properties": {
        "error": {"type": "number", "description": "m, distance from the plan"},
        "thrust": {"type": "number", "description": "N, collective"},
        "letter": {"type": "string", "description": "regions and internal propositions"},
        "rotors": {"type": "array", "items": {"type": "number"}, "description": "N"},
    },
}


def mcap_bytes(given: FlightLog) -> bytes:
    """Return the log as the bytes of an MCAP file; of many robots as `lightened` keeps it, with quaternions to 1e-5.

    Raises:
        MissingEngine: mcap is not installed.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        raise MissingEngine("MCAP needs mcap: pip install 'ltlplan[mcap]'.") from None
    log = lightened(given)
    sink = io.BytesIO()
    writer: Any = Writer(sink)
    writer.start(profile="", library="ltlplan")
    about = {"mission": log.mission, "certificate": log.certificate or "", "verdicts": "\n".join(log.verdicts)}
    writer.add_metadata(name="ltlplan", data=about)
    schemas = [
        writer.register_schema(name=str(schema["title"]), encoding="jsonschema", data=json.dumps(schema).encode())
        for schema in (_POSE, _STATE)
    ]
    channels = [
        [
            writer.register_channel(topic=f"/{robot}/{name}", message_encoding="json", schema_id=schema)
            for name, schema in zip(("pose", "state"), schemas, strict=True)
        ]
        for robot in log.robots
    ]
    turned = np.stack([from_euler(log.attitude[:, j].T).T for j in range(len(log.robots))], axis=1)
    if log is not given:
        turned = np.round(turned, 5)
    for i, time in enumerate(log.times.tolist()):
        moment = round(1e9 * time)
        for j, (pose_channel, state_channel) in enumerate(channels):
            w, x, y, z = turned[i, j].tolist()
            position = dict(zip("xyz", log.position[i, j].tolist(), strict=True))
            pose = {
                "timestamp": {"sec": moment // 10**9, "nsec": moment % 10**9},
                "frame_id": "world",
                "pose": {"position": position, "orientation": {"x": x, "y": y, "z": z, "w": w}},
            }
            state = {
                "error": float(log.error[i, j]),
                "thrust": float(log.thrust[i, j]),
                "letter": " ".join(sorted(log.letters[i][j])),
                "rotors": [] if log.rotors is None else log.rotors[i, j].tolist(),
            }
            for channel, message in ((pose_channel, pose), (state_channel, state)):
                writer.add_message(channel_id=channel, log_time=moment, publish_time=moment, data=json.dumps(message).encode())
    writer.finish()
    return sink.getvalue()
