"""What a server has done, as text in the format of Prometheus."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from threading import Lock

# Upper bounds of the times that are counted, in seconds.
BOUNDS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


class Metrics:
    """Counts requests by call and status, and how long they took."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._requests: Counter[tuple[str, int]] = Counter()
        self._buckets: Counter[tuple[str, float]] = Counter()
        self._seconds: Counter[str] = Counter()
        self._counts: Counter[str] = Counter()

    def count(self, call: str, status: int, seconds: float) -> None:
        """Count a request to one of few calls, and the seconds until the end of its answer."""
        bound = next((bound for bound in BOUNDS if seconds <= bound), float("inf"))
        with self._lock:
            self._requests[call, status] += 1
            self._buckets[call, bound] += 1
            self._seconds[call] += seconds  # type: ignore[assignment]
            self._counts[call] += 1

    def write(self, gauges: Mapping[str, float]) -> str:
        """Return the text; `gauges` are values of now, by name."""
        lines = ["# TYPE sgm_requests_total counter"]
        with self._lock:
            for (call, status), number in sorted(self._requests.items()):
                lines.append(f'sgm_requests_total{{call="{call}",status="{status}"}} {number}')
            lines.append("# TYPE sgm_request_seconds histogram")
            for call in sorted(self._counts):
                total = 0
                for bound in (*BOUNDS, float("inf")):
                    total += self._buckets[call, bound]
                    name = "+Inf" if bound == float("inf") else f"{bound:g}"
                    lines.append(f'sgm_request_seconds_bucket{{call="{call}",le="{name}"}} {total}')
                lines.append(f'sgm_request_seconds_sum{{call="{call}"}} {self._seconds[call]:.6f}')
                lines.append(f'sgm_request_seconds_count{{call="{call}"}} {self._counts[call]}')
        own = {"sgm_process_cpu_seconds_total": time.process_time(), **gauges}
        for name, value in own.items():
            kind = "counter" if name.endswith("_total") else "gauge"
            lines += [f"# TYPE {name} {kind}", f"{name} {value:.10g}"]
        return "\n".join(lines) + "\n"
