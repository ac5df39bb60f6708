import os

import pytest
from hypothesis import settings

# The variables that our packages set on import, for tests that import the dependency first.
os.environ.setdefault("DGLBACKEND", "pytorch")
os.environ.setdefault("MPLBACKEND", "Agg")

# The same examples on every run, and no time limit per example: a busy machine is not a failure.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

# What pytest writes where nobody has said why a test is skipped.
_NO_REASON = ("could not import", "unconditional skip", "condition:")


def _refuse_unnamed_skip(report):
    """Let a skip without a reason of its own fail: who reads the summary must know what to do."""
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = str(report.longrepr[2]).removeprefix("Skipped: ").strip()
        if reason in ("", "Skipped") or reason.startswith(_NO_REASON):
            report.outcome = "failed"
            report.longrepr = (
                f"a skip must have a named reason, got {reason!r}. Say what is missing, and how to "
                "get it: reason='spark_dsg is not installed: extra spark'."
            )
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    return _refuse_unnamed_skip((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    return _refuse_unnamed_skip((yield))
