"""What a node lacks to see anything, said in its log: the usual trouble of a first start."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

_SECONDS = 10.0  # from one look for gaps to the next


class GapWatch:
    """Warns of topics without a publisher of their type, then of what all frames lack.

    Each warning is said once, until it is another one or the gap is closed.
    """

    def __init__(self, node: Any, feed: Any, needed: Sequence[Any]) -> None:
        """Say which topics are waited for, and start a timer of the node.

        Args:
            node: has the log.
            feed: the `CameraFeed`, which knows what frames lack.
            needed: subscriptions without which nothing is seen.
        """
        self._node, self._feed, self._needed = node, feed, needed
        self._told = ""
        topics = ", ".join(one.topic_name for one in needed)
        node.get_logger().info(f"ready, and listens to {topics}")
        node.create_timer(_SECONDS, self.report)

    def report(self) -> None:
        """Warn of what is missing now, if that has not just been said."""
        silent = [text for text in map(self._find_silence, self._needed) if text]
        gap = " ".join(silent) or self._feed.find_gap()
        if gap and gap != self._told:
            self._node.get_logger().warning(gap)
        self._told = gap

    def _find_silence(self, subscription: Any) -> str:
        """Say what a topic lacks; "" where a publisher has the type that is read."""
        kind, topic = subscription.msg_type, subscription.topic_name
        wanted = f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
        types = {one.topic_type for one in self._node.get_publishers_info_by_topic(topic)}
        if wanted in types:
            return ""
        got = ", ".join(sorted(types)) or "none"
        return f"{topic} must have a publisher of {wanted}, got {got}. Start it, or name its topic."
