"""The table that compares one model with every other policy on the same homes."""

from __future__ import annotations

from collections.abc import Mapping

from rich.table import Table

from nep.statistics import compute_bootstrap_interval, compute_gap_closed
from simulator.evaluation import Scores


class Comparison:
    """Accuracy of every policy, the worst first, and its paired distance to the model.

    Attributes:
        columns: titles.
        rows: texts, one row per policy.
        summary: candidate recall and the share of the gaps that is closed.
    """

    def __init__(self, scores: Mapping[str, Scores], name: str) -> None:
        """Compute rows and summary.

        Args:
            scores: of every policy on the same homes, "bayesian", "oracle", "ceiling" included.
            name: the model's.

        Source: ruling 22.
        """
        self.name = name
        self.columns = ("policy", "accuracy", "std over homes", f"{name} minus policy [95 %]")
        own = scores[name].accuracy
        self.rows: list[tuple[str, str, str, str]] = []
        for other, score in sorted(scores.items(), key=lambda item: item[1].accuracy.mean()):
            accuracy = score.accuracy
            low, high = compute_bootstrap_interval(own - accuracy)
            distance = f"{(own - accuracy).mean():+.3f} [{low:+.3f}, {high:+.3f}]"
            self.rows.append(
                (
                    other,
                    f"{accuracy.mean():.3f}",
                    f"{accuracy.std():.3f}",
                    "" if other == name else distance,
                )
            )
        closed = {
            top: compute_gap_closed(
                float(own.mean()),
                float(scores["bayesian"].accuracy.mean()),
                float(scores[top].accuracy.mean()),
            )
            for top in ("oracle", "ceiling")
        }
        self.summary = (
            f"candidate recall {scores[name].candidate_recall:.3f}; "
            f"Bayesian-to-Oracle gap closed {closed['oracle']:.0%}, "
            f"Bayesian-to-Ceiling gap closed {closed['ceiling']:.0%}"
        )

    def make_table(self, title: str) -> Table:
        """Return the table for a terminal, the model in bold."""
        table = Table(title=title)
        for column in self.columns:
            table.add_column(column, justify="left" if column == "policy" else "right")
        for row in self.rows:
            table.add_row(*row, style="bold" if row[0] == self.name else None)
        return table

    def make_markdown(self, title: str) -> str:
        """Return the table and the summary as Markdown, the model in bold."""
        lines = [f"{title}.", "", "| " + " | ".join(self.columns) + " |"]
        lines.append("| --- |" + " ---: |" * (len(self.columns) - 1))
        for row in self.rows:
            cells = [f"**{cell}**" if row[0] == self.name and cell else cell for cell in row]
            lines.append("| " + " | ".join(cells) + " |")
        return "\n".join([*lines, "", f"{self.summary}.", ""])
