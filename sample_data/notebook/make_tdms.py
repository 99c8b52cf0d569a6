"""python3 make_tdms.py RUN.csv OUT.tdms: a run file as NI's logger writes it, angle and load cell as doubles with their rate, in one segment."""
import struct
import sys


def text(s):
    return struct.pack("<I", len(s.encode())) + s.encode()


def channel(name, unit, values, step):
    properties = [("unit_string", 0x20, text(unit)), ("wf_increment", 10, struct.pack("<d", step)), ("wf_start_offset", 10, struct.pack("<d", 0.0)), ("wf_samples", 3, struct.pack("<i", len(values)))]
    head = text(f"/'rig'/'{name}'") + struct.pack("<IIIQ", 20, 10, 1, len(values)) + struct.pack("<I", len(properties))
    return head + b"".join(text(key) + struct.pack("<I", kind) + value for key, kind, value in properties), struct.pack(f"<{len(values)}d", *values)


lines = [line for line in open(sys.argv[1], encoding="utf-8").read().splitlines() if not line.startswith("#")]
rows = [[float(cell) for cell in line.split(",")[:3]] for line in lines[1:]]
time, angle, load = zip(*rows)
step = (time[-1] - time[0]) / (len(time) - 1)
channels = [channel("Angle", "deg", angle, step), channel("Load cell", "N", load, step)]
meta = struct.pack("<I", 2 + len(channels)) + b"".join(text(path) + struct.pack("<II", 0xFFFFFFFF, 0) for path in ("/", "/'rig'")) + b"".join(head for head, _ in channels)
data = b"".join(values for _, values in channels)
with open(sys.argv[2], "wb") as out:
    out.write(b"TDSm" + struct.pack("<IIQQ", 2 + 4 + 8, 4713, len(meta) + len(data), len(meta)) + meta + data)
