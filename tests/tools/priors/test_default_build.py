"""The build of the shipped prior is reproducible."""

from importlib.util import find_spec

import pytest

from sgm.prior.prior_graph import PriorGraph
from tools.priors.build import build_from_sources
from tools.priors.compare import compare_priors

needs_packages = pytest.mark.skipif(
    find_spec("procthor") is None or find_spec("bddl") is None,
    reason="needs the build-time packages procthor and bddl (extra `priors`)",
)


@pytest.mark.slow
@needs_packages
def test_rebuild_is_reproducible_and_close_to_the_shipped_file(tmp_path):
    paths = [tmp_path / "a.json", tmp_path / "b.json"]
    for path in paths:
        prior, report, _ = build_from_sources(num_houses=300)
        prior.save(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert not report.dropped_objects
    result = compare_priors(prior, PriorGraph.default())
    assert result.furniture_correlation > 0.95
    assert result.placement_correlation > 0.9
