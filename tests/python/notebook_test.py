"""python3 notebook_test.py UNRIG NOTEBOOK SAMPLE_DATA, with the package on PYTHONPATH: every cell of the notebook runs, and what it finds is what the samples hide. Status 77: a package is not there."""
import os
import pathlib
import re
import sys

try:
    import ipykernel  # noqa: F401
    import matplotlib  # noqa: F401
    import nbformat
    import xarray  # noqa: F401
    from nbclient import NotebookClient
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-nbclient, python3-ipykernel, python3-matplotlib, python3-xarray)")
    sys.exit(77)

os.environ["UNRIG_PROGRAM"], os.environ["UNRIG_SAMPLES"], os.environ["MPLBACKEND"] = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[3]), "Agg"
notebook = nbformat.read(sys.argv[2], as_version=4)
assert len(notebook.cells) == 10
assert not any(cell.get("outputs") for cell in notebook.cells), "a notebook is committed without outputs"
NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(pathlib.Path(sys.argv[2]).parent)}}).execute()


def printed(cell):
    return "".join(output.get("text", "") or output.get("data", {}).get("text/plain", "") for output in cell.outputs)


text = "\n".join(printed(cell) for cell in notebook.cells if cell.cell_type == "code")
assert "rig/Load cell" in text and "step_a.csv: 3000 samples" in text, text
assert printed(notebook.cells[5]).rstrip().endswith("True"), printed(notebook.cells[5])
truth = float([row for row in (pathlib.Path(sys.argv[3]) / "campaigns" / "null" / "truth_step_a.csv").read_text().splitlines() if not row.startswith("#")][-1].split(",")[3])  # circulatory [N]
load, error = map(float, re.search(r"(\S+) \+- (\S+) N at the end", text).groups())
assert abs(load - truth) < 0.02 * abs(truth) and 0 < error < 0.01 * abs(truth), (load, error, truth)
assert "Nothing is missing" in text and text.rstrip().endswith("[]"), text[-300:]
print(f"the notebook runs: {load} +- {error} N, true {truth} N, nothing missing")
