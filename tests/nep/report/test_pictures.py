"""Pictures of an evaluation: the calibration diagram and searches."""

import matplotlib.pyplot as plt
import numpy as np

from nep.callbacks.online_config import OnlineConfig
from nep.callbacks.online_evaluation import OnlineEvaluation
from nep.report.figures import draw_calibration, draw_searches, play_search_stories
from nep.report.results import ScoreSummary
from simulator import Bayesian, HomeConfig
from simulator.tasks.find_object import FindObject
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def test_calibration_is_the_share_that_is_right_in_each_tenth():
    confidence = np.array([0.12, 0.18, 0.55, 1.0])
    figure = draw_calibration(confidence, np.array([True, False, True, True]), "title")
    (axes,) = figure.axes
    _, line = axes.lines
    # .12 and .18 share a bin: said .15 in the mean, one of two right. 1.0 is in the last bin.
    np.testing.assert_allclose(line.get_xdata(), [0.15, 0.55, 1.0])
    np.testing.assert_allclose(line.get_ydata(), [0.5, 1.0, 1.0])
    heights = [bar.get_height() for bar in axes.patches]
    assert heights == [0, 0.5, 0, 0, 0, 0.25, 0, 0, 0, 0.25]


def test_searches_are_those_of_the_task():
    source = SampledSource(None, HomeConfig(rooms=("kitchen",), furniture_per_room=6))
    stories = play_search_stories(lambda homes: Bayesian(), source, 3, "val")
    game = FindObject(source.make(Streams(3, "val", [0])), Bayesian())
    looks = [int(search.num_looks[0]) for search in game.search(13)]
    assert [len(story.looks) for story in stories] == looks[-3:]
    for story in stories:
        assert story.looks[-1] in story.true_places
        np.testing.assert_allclose(story.belief.sum(), 1)
        assert len(story.belief) == 6
    figure = draw_searches(stories)
    assert [axes.get_title(loc="left").split(":")[0] for axes in figure.axes] == [
        story.description for story in stories
    ]
    figure.canvas.draw()
    plt.close("all")


def test_scores_of_each_kind_of_home():
    evaluation = OnlineEvaluation(OnlineConfig(num_homes=4))
    evaluation._kinds = ["PaperDynamics", "RoutineDynamics", "PaperDynamics", "PaperDynamics"]
    scores = ScoreSummary(np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 0.0]]), {})
    # Homes score .5, 1, 0 and .5: the paper's (.5 + 0 + .5) / 3.
    assert evaluation._score_kinds(None, scores) == {
        "online_kinds/accuracy_PaperDynamics": 1 / 3,
        "online_kinds/accuracy_RoutineDynamics": 1.0,
    }
    evaluation._kinds = ["PaperDynamics"] * 4
    assert evaluation._score_kinds(None, scores) == {}
