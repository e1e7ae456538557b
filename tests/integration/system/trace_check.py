#!/usr/bin/env python3
"""Reads a trace as protoc decodes it and says what is in it, as JSON.

Usage: trace_check.py FILE

Exits with 1, with a line for each fault, if the trace cannot be right. Such faults are a slice without a begin or an end, an
event without a track, and an arrow that goes back in time."""

import json
import pathlib
import re
import subprocess
import sys

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "support"


def decoded(file):
    """The packets, each as a dictionary of lists."""
    with open(file, "rb") as trace:
        told = subprocess.run(
            ["protoc", f"--proto_path={FOLDER}", "--decode=Trace", str(FOLDER / "perfetto_trace.proto")],
            stdin=trace, capture_output=True, text=True, check=True)
    root = {}
    stack = [root]
    for line in told.stdout.splitlines():
        line = line.strip()
        if line == "}":
            stack.pop()
        elif line.endswith(" {"):
            part = {}
            stack[-1].setdefault(line[:-2], []).append(part)
            stack.append(part)
        else:
            name, value = line.split(": ", 1)
            value = json.loads(value) if re.fullmatch(r'-?\d+|"[^\\]*"', value) else value
            stack[-1].setdefault(name, []).append(value)
    return root.get("packet", [])


def one(message, name, default=None):
    return message.get(name, [default])[0]


class Trace:
    def __init__(self, packets):
        self.faults = []
        self.tracks = {}
        self.events = []
        for packet in packets:
            for track in packet.get("track_descriptor", []):
                self.tracks[one(track, "uuid")] = track
            for event in packet.get("track_event", []):
                self.events.append((one(packet, "timestamp", 0), event))
            if one(packet, "trusted_packet_sequence_id", 0) == 0:
                self.faults.append("a packet without a sequence")
        self.events.sort(key=lambda event: event[0])

    def path(self, uuid):
        track = self.tracks.get(uuid)
        if track is None:
            self.faults.append(f"no track {uuid}")
            return "?"
        parent = one(track, "parent_uuid")
        name = one(one(track, "process", {}), "process_name") or one(track, "name")
        return f"{self.path(parent)}/{name}" if parent else name

    def summary(self):
        open_slices, counts, flows, notes = {}, {}, {}, {}
        for time, event in self.events:
            path = self.path(one(event, "track_uuid"))
            kind = one(event, "type")
            if kind == "TYPE_SLICE_END":
                if not open_slices.get(path):
                    self.faults.append(f"an end without a begin on {path} at {time}")
                else:
                    open_slices[path].pop()
                continue
            name = one(event, "name")
            if kind == "TYPE_SLICE_BEGIN":
                open_slices.setdefault(path, []).append(name)
            counts.setdefault(path, {}).setdefault(re.sub(r"\d+$", "N", name), 0)
            counts[path][re.sub(r"\d+$", "N", name)] += 1
            for note in event.get("debug_annotations", []):
                notes.setdefault(path, {})[one(note, "name")] = one(note, "int_value", one(note, "string_value"))
            for flow in event.get("flow_ids", []):
                flows.setdefault(flow, []).append((time, path, name))
        for path, names in open_slices.items():
            if names:
                self.faults.append(f"{len(names)} slices without an end on {path}")
        chains = {}
        for chain in flows.values():
            cycles = [time for time, _, name in chain if name == "cycle"]
            posts = [time for time, _, name in chain if name.startswith("posted ")]
            if cycles and posts and min(cycles) < max(posts):
                self.faults.append(f"a cycle before its post: {chain}")
            key = " > ".join(sorted({path for _, path, _ in chain}))
            chains[key] = chains.get(key, 0) + 1
        return {"tracks": sorted(self.path(uuid) for uuid in self.tracks), "counts": counts, "flows": chains, "notes": notes,
                "from": self.events[0][0] if self.events else 0, "to": self.events[-1][0] if self.events else 0}


def main():
    trace = Trace(decoded(sys.argv[1]))
    print(json.dumps(trace.summary(), indent=1))
    for fault in trace.faults[:20]:
        print(fault, file=sys.stderr)
    return 1 if trace.faults else 0


if __name__ == "__main__":
    sys.exit(main())
