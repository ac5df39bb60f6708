"""Peak memory of `python -m nep.fit` while it collects 10,000 memories and trains on them.

Above what the imports alone take, in one process: collection, heuristics, validation, and the first
batches of training; later ones need no more.

Limit: the data. 10,000 snapshots take 14 MB on disk and as much when loaded; a hundred homes in
lockstep take 0.1 MB each (weights of places, dynamics); a batch of 100 graphs with 64 features
for each edge and its gradients some 30 MB.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile

from _measure import Benchmark, Measure, run

# The peak of the program itself: what getrusage says starts with that of the process it came from.
_CODE = """
import json, re, sys
from nep import fit
def peak(): return int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) / 1e6
before = peak()
fit.main(sys.argv[1:])
print(json.dumps([before, peak()]), flush=True)
"""


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Choose the size."""
    homes, steps, batches = (2, 5, 1) if tiny else (100, 100, 10)

    def measure() -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory() as folder:
            options = {
                "--config": "heat.yaml",
                "--data.data_dir": folder,
                "--data.num_homes": homes,
                "--data.steps": steps,
                "--data.workers": 1,
                "--data.num_val_homes": min(homes, 20),
                "--trainer.max_epochs": 1,
                "--trainer.limit_train_batches": batches,
                "--trainer.limit_val_batches": batches,
                "--trainer.logger": "false",
                "--trainer.enable_checkpointing": "false",
                "--trainer.enable_progress_bar": "false",
                "--trainer.enable_model_summary": "false",
                "--trainer.default_root_dir": folder,
                "--online.num_homes": min(homes, 20),
                "--online.steps": min(steps, 10),
            }
            command = [sys.executable, "-c", _CODE]
            for name, value in options.items():
                command += [name, str(value)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
        before, after = json.loads(done.stdout.splitlines()[-1])
        return after - before, {"imports": before}

    return measure, f"{homes} homes x {steps} steps, then {batches} batches"


if __name__ == "__main__":
    benchmark = Benchmark("memory of collecting and training", "GB", 1, is_higher_better=False)
    run(benchmark, prepare, repeats=1)
