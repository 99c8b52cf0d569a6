"""Feeds `unrig import` with files whose bytes are changed at random: for what libFuzzer cannot be linked to, since a child process reads it (MATLAB 7.3).

  python3 tests/fuzz/mutate.py build/unrig FILE [SECONDS]

Exit 0 or 2 with a message is an answer; a signal, another status, no message or ten seconds are findings. They stay in build/fuzz as mutated-*.
"""

import pathlib
import random
import subprocess
import sys
import time


def mutated(good: bytes, chance: random.Random) -> bytes:
    data = bytearray(good)
    for _ in range(chance.choice([1, 2, 4, 16, 64])):
        data[chance.randrange(len(data))] = chance.choice([0, 1, 127, 128, 255, chance.randrange(256)])
    if chance.random() < 0.2:
        del data[chance.randrange(len(data)) :]
    return bytes(data)


def main() -> int:
    program, seed_file, seconds = sys.argv[1], pathlib.Path(sys.argv[2]), float(sys.argv[3]) if len(sys.argv) > 3 else 600
    folder = pathlib.Path("build/fuzz")
    folder.mkdir(parents=True, exist_ok=True)
    good, chance = seed_file.read_bytes(), random.Random(1)
    inputs = refused = findings = 0
    end = time.monotonic() + seconds
    trial = folder / f"mutated{seed_file.suffix}"
    while time.monotonic() < end:
        trial.write_bytes(mutated(good, chance))
        try:
            run = subprocess.run([program, "import", trial, "--list"], capture_output=True, timeout=10)
            answered = run.returncode == 0 or (run.returncode == 2 and run.stderr.strip())
        except subprocess.TimeoutExpired:
            run, answered = None, False
        inputs += 1
        refused += bool(run and run.returncode == 2)
        if not answered:
            findings += 1
            trial.rename(folder / f"mutated-{findings}{seed_file.suffix}")
    print(f"{inputs} inputs in {seconds:.0f} s, {refused} of them refused, {findings} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
