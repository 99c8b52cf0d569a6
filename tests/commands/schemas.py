"""python3 schemas.py UNRIG SCHEMAS SAMPLE_DATA: every JSON result that the program writes is what its schema says, and a file with one thing wrong is not.

Each schema is tried on results that differ in what they hold. Then, of each kind of place in them, what stands there is replaced, a key is left out, and one is added:
the schema has to refuse all three. At last every key that a schema names has to have stood in a result, but for those in `rare`. Status 77: python3-jsonschema is not there."""
import copy
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

try:
    from jsonschema import Draft202012Validator, RefResolver
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-jsonschema)")
    sys.exit(77)

program, folder, samples = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
schemas = {path.name: json.loads(path.read_text()) for path in sorted(folder.glob("*.schema.json"))}
validators = {}
for name, schema in schemas.items():
    Draft202012Validator.check_schema(schema)
    assert schema["$id"] == name, name
    validators[schema["properties"]["unrig"]["const"]] = Draft202012Validator(schema, resolver=RefResolver.from_schema(schema, store=schemas))

# What these calls, which are to be short, do not bring about: a set as good as the one found and what would tell them apart, a law with memory or followed in smaller steps, a trial that fails.
rare = {"recording", "difference_over_noise", "as_recorded", "memory", "law_steps", "failure"}


def campaign(name, *files):
    return ["--rig", samples / "campaigns" / name / "rig.toml", *(samples / "campaigns" / name / file for file in files)]


def unrig(*words, status=(0,)):
    finished = subprocess.run([program, *map(str, words), "--quiet"], capture_output=True, text=True)
    assert finished.returncode in status, (words, finished.returncode, finished.stderr)


def write(path, text):
    path.write_text(text)
    return path


def damped_decay(path, x, hertz=7, dt=0.004, samples=900, finer=40):
    """x'' + 2 zeta omega (1 + (2x)^2) x' + omega^2 x = 0 by Euler's semi-implicit method, with noise."""
    omega = 2 * math.pi * hertz
    noise, h, v, lines = random.Random(x), dt / finer, 0.0, ['# unrig_run = 1', '# kind = "pluck"', '# medium = "air"', '# density = "1.2 kg/m^3"', '# speed = "0 m/s"', "time [s],gauge [N]"]
    for i in range(samples):
        lines.append(f"{i * dt:.3f},{x + noise.gauss(0, 0.002):.6f}")
        for _ in range(finer):
            v -= h * (0.02 * omega * (1 + 4 * x * x) * v + omega**2 * x)
            x += h * v
    return write(path, "\n".join(lines) + "\n")


def held_pluck(path, decay, held=200, step=0.002):
    """A decay of the samples behind the hold before its release."""
    noise, lines = random.Random(1), decay.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith("#")) + 1
    level = lines[first].split(",")[2]
    hold = [f"{step * k:.3f},0,{float(level) + noise.gauss(0, 0.03):.5f}" for k in range(held)]
    behind = [f"{float(time) + step * held:.3f},{rest}" for time, rest in (line.split(",", 1) for line in lines[first:])]
    return write(path, "\n".join([*lines[:first], *hold, *behind]) + "\n")


def behind_a_filter(path, samples=8000, step=0.004):
    """A decay at 7 Hz with noise that has gone through a filter against aliasing: white at four times the rate, a windowed sinc."""
    at = [math.pi * (j - 20) / 4 for j in range(41)]
    answer = [(0.54 - 0.46 * math.cos(math.pi * j / 20)) * (math.sin(x) / x if x else 1) for j, x in enumerate(at)]
    noise, lines = random.Random(2), ['# unrig_run = 1', '# kind = "pluck"', '# medium = "air"', '# density = "1.2 kg/m^3"', '# speed = "0 m/s"', "time [s],gauge [N]"]
    white = [noise.gauss(0, 0.002) for _ in range(4 * samples + 41)]
    for k in range(samples):
        decay = math.exp(-0.4 * step * k) * math.cos(2 * math.pi * 7 * step * k)
        lines.append(f"{step * k:.3f},{decay + sum(a * white[4 * k + j] for j, a in enumerate(answer)):.6f}")
    return write(path, "\n".join(lines) + "\n")


def make_results(out):
    """All kinds of results, into the folder `out`."""
    decays, steps = ("dry_pluck.csv", "wet_pluck.csv"), ("step_a.csv", "step_b.csv")
    null = samples / "campaigns" / "null"
    unrig("fit", *campaign("null", *decays, *steps), "--profile", "normal.stiffness_scale", "-o", out / "fit.json")
    unrig("fit", *campaign("null", "dry_pluck.csv", "step_a.csv"), "--effect", "gauge-lowpass", "-o", out / "fit_unidentified.json")
    unrig("fit", *campaign("drag", "wet_pluck.csv"), "--anyway", "-o", out / "fit_bad.json", status=(0, 1))
    unrig("fit", "--rig", samples / "impact" / "rig.toml", samples / "impact" / "hammer.csv", "-o", out / "fit_modes.json", status=(0, 1))
    unrig("fit", *campaign("null", "dry_pluck.csv"), "--start", "normal.stiffness_scale=30", "-o", out / "fit_lost.json", status=(1,))
    law = write(out / "law.toml", 'unrig_law = 1\nname = "drag"\nacts_on = "normal"\nforce = "-c * abs(v) * v"\n[parameters]\nc = { start = "1 N" }\n[scales]\nv = "1 m/s"\n')
    unrig("fit", *campaign("null", *decays), "--law", law, "-o", out / "fit_law.json", status=(0, 1))
    stated = write(out / "stated.toml", (null / "rig.toml").read_text().replace('mass.unit = "lb"', 'mass.unit = "lb"\nmass.std_percent = 1.0', 1).replace("[section]", '[section]\nchord_std = "0.5 mm"', 1))
    run = write(out / "stated.csv", (null / "step_a.csv").read_text().replace("# medium", "# speed_std_percent = 0.5\n# medium", 1))
    unrig("fit", "--rig", stated, *(null / file for file in decays), run, "-o", out / "fit_givens.json")
    random.seed(1)
    noise, lines = 0.0, (null / "step_a.csv").read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith("#")) + 1
    for i in range(first, len(lines)):  # wandering by 0.2 N with a memory of 0.2 s
        noise = 0.99 * noise + random.gauss(0, 0.03)
        cells = lines[i].split(",")
        lines[i] = ",".join([*cells[:2], f"{float(cells[2]) + noise:.6f}", *cells[3:]])
    unrig("fit", *campaign("null", *decays), write(out / "wandering.csv", "\n".join(lines) + "\n"), "-o", out / "fit_coloured.json", status=(0, 1))

    unrig("diagnose", *campaign("null", *decays, "step_a.csv"), "--heldout", null / "heldout.csv", "-o", out / "diagnosis.json")
    unrig("diagnose", *campaign("drag", "wet_pluck.csv"), "--effects", "quadratic-drag", "--fit", out / "fit_winning.json", "-o", out / "diagnosis_drag.json", status=(0, 1))
    long_chord = write(out / "long_chord.toml", (null / "rig.toml").read_text().replace('chord = "6 in"', 'chord = "6.06 in"'))
    unrig("diagnose", "--rig", long_chord, *(null / run for run in (*decays, "step_a.csv", "step_b.csv", "step_c.csv")), "--effects", "tank-wave", "-o", out / "diagnosis_rig.json")
    unrig("diagnose", *campaign("wave", *decays, "step_a.csv"), "--effects", "coulomb-friction", "-o", out / "diagnosis_unexplained.json", status=(1,))
    unrig("diagnose", *campaign("wave", *decays, "step_a.csv"), "--limit", "0.001", "-o", out / "diagnosis_stopped.json", status=(1,))

    mode = write(out / "mode.toml", 'unrig_rig = 1\nname = "one mode"\n[[modal]]\nmass = "1 kg"\nfrequency = "7 Hz"\ndamping_ratio = 0.01\ngauge_gain = "1 N/m"\n')
    unrig("diagnose", "--rig", mode, *(damped_decay(out / f"{name}.csv", start) for name, start in (("large", 1.0), ("small", -0.4))), "-o", out / "diagnosis_law.json", status=(0, 1))

    unrig("fit", "--rig", mode, behind_a_filter(out / "behind_a_filter.csv"), "-o", out / "fit_behind_a_filter.json", status=(0, 1))

    for shard in (1, 2):
        unrig("trial", *campaign("null", "wet_pluck.csv"), "--trials", 3, "--seed", 2, "--effects", "tank-wave,gauge-lowpass", "--shard", f"{shard}/2", "-o", out / f"trial_{shard}.json")
    unrig("collect", out / "trial_1.json", out / "trial_2.json", "-o", out / "trial.json")
    unrig("trial", *campaign("null", *decays, "step_a.csv"), "--trials", 1, "--effects", "tank-wave", "-o", out / "trial_alike.json")
    half_a_second = write(out / "half_a_second.csv", "".join((null / "dry_pluck.csv").read_text().splitlines(True)[:257]))
    unrig("trial", *campaign("null"), half_a_second, "--law", "--ideal", "--noise", "0.1 N", "--seed", 3, "--trials", 1, "-o", out / "trial_law.json")

    unrig("apparent-mass", *campaign("null"), "--dry", null / decays[0], "--wet", null / decays[1], "-o", out / "apparent.json")
    modes = write(out / "modes.toml", 'unrig_rig = 1\nname = "one mode"\n[[modal]]\nmass = "7.9 kg"\nfrequency = "6.85 Hz"\ndamping_ratio = 0.01\ngauge_gain = "10000 N/m"\n')
    unrig("apparent-mass", "--rig", modes, "--dry", null / decays[0], "--wet", null / decays[1], "-o", out / "apparent_modes.json", status=(0, 1))

    held = held_pluck(out / "held.csv", null / decays[0])
    unrig("fit", *campaign("null"), held, "-o", out / "fit_held.json")
    unrig("apparent-mass", *campaign("null"), "--dry", held, "--wet", null / decays[1], "-o", out / "apparent_held.json")
    unrig("check", *campaign("null"), held, "-o", out / "check_held.json")

    unrig("check", *campaign("null"), "-o", out / "check_rig.json")
    unrig("check", *campaign("null", "dry_pluck.csv", "step_a.csv"), "-o", out / "check.json")
    unrig("check", "--rig", modes, null / "dry_pluck.csv", "-o", out / "check_modes.json", status=(0, 1))
    pounds = write(out / "pounds.csv", (null / "step_b.csv").read_text().replace("gauge [N]", "gauge [lbf]"))
    unrig("check", *campaign("null", *decays, "step_a.csv"), pounds, "-o", out / "check_pounds.json", status=(1,))


def places(value, path=()):
    """Every value with its path."""
    yield path, value
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*path, key))


def kind_of(path):
    return tuple("*" if isinstance(key, int) else key for key in path)


def changed(result, path, change):
    """A copy with what stands at `path` changed in its holder."""
    result = copy.deepcopy(result)
    holder = result
    for key in path[:-1]:
        holder = holder[key]
    change(holder, path[-1])
    return result


def required(schema, root, path):
    """Whether the key at the end of `path` is one that its schema requires; None where the keys are names of the user's."""
    if "$ref" in schema:
        name, _, inner = schema["$ref"].partition("#")
        root = schemas[name] if name else root
        target = root
        for part in inner.strip("/").split("/") if inner else ():
            target = target[part]
        return required(target, root, path)
    if "oneOf" in schema:
        return required(next(one for one in schema["oneOf"] if one.get("type") != "null"), root, path)
    if isinstance(path[0], int):
        return required(schema["items"], root, path[1:])
    if "properties" not in schema:
        return None
    return path[0] in schema["required"] if len(path) == 1 else required(schema["properties"][path[0]], root, path[1:])


def thinned(result):
    """The first three entries of each list: as good for what is tried below, and quicker. Tables stay whole."""
    if isinstance(result, dict):
        return {key: thinned(inner) for key, inner in result.items()}
    return [thinned(inner) for inner in result[:3]] if isinstance(result, list) else result


def names_in(schema):
    if isinstance(schema, dict):
        for key, inner in schema.items():
            yield from inner if key == "properties" else ()
            yield from names_in(inner)
    elif isinstance(schema, list):
        for inner in schema:
            yield from names_in(inner)


tried, results, seen, known = 0, {}, set(), set()
with tempfile.TemporaryDirectory() as out:
    out = pathlib.Path(out)
    make_results(out)
    for path in sorted(out.glob("*.json")):
        results[path.name] = json.loads(path.read_text())
for file, whole in results.items():
    validator = validators[whole["unrig"]]
    errors = [f"{list(error.path)}: {error.message[:200]}" for error in validator.iter_errors(whole)]
    assert not errors, f"{file} is not what its schema says: {errors[:5]}"
    for other, wrong in validators.items():
        assert other == whole["unrig"] or not wrong.is_valid(whole), f"{file} passes for {other}"
    result = thinned(whole)
    assert validator.is_valid(result), file
    for path, value in places(result):
        kind = (whole["unrig"], *kind_of(path), type(value).__name__)
        seen.update(key for key in path if isinstance(key, str))
        if not path or kind in known:
            continue
        known.add(kind)
        bad = [changed(result, path, lambda holder, key: holder.__setitem__(key, [{"other": 0}]))]
        if isinstance(value, dict) and "confusion" not in path:
            bad.append(changed(result, path, lambda holder, key: holder[key].__setitem__("no_such_key", 0)))
        if isinstance(path[-1], str) and required(validator.schema, validator.schema, path):
            bad.append(changed(result, path, lambda holder, key: holder.pop(key)))
        if path[-1] in ("std_error", "noise", "samples", "rms_residual", "rms_after", "p_value", "probability", "hidden", "found", "rate", "damping_ratio_std_error") and isinstance(value, (int, float)) and not isinstance(value, bool):
            bad.append(changed(result, path, lambda holder, key: holder.__setitem__(key, -1)))
        for one in bad:
            tried += 1
            assert not validator.is_valid(one), f"{file}: {'.'.join(map(str, path))} may be anything, or missing"
unseen = {name for schema in schemas.values() for name in names_in(schema)} - seen - rare
assert not unseen, f"no result here has {sorted(unseen)}"
assert set(validators) == {result["unrig"] for result in results.values()}
print(f"{len(results)} results are what {len(schemas)} schemas say; {tried} wrong ones are refused")
