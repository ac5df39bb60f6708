"""The benchmark of recorded homes: `python -m nep.recorded --trace DIR`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import torch
from jsonargparse import ArgumentParser, Namespace

from nep.kinds.command import add_table_options, describe_made, list_names, make_command
from nep.kinds.comparisons import make_overview
from nep.kinds.kinds import choose_kinds, list_benchmark
from nep.kinds.play import play_all
from nep.kinds.played import Played, find_scores
from nep.kinds.table import make_accuracy_table, make_table
from nep.players.contestants import Checkpoint
from nep.players.left_out import LeftOut
from nep.report.figures import draw_by_hour
from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.messages import shorten
from sgm.prior.prior_graph import load_prior
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from simulator.trace.source import check_step_seconds
from simulator.trace.trace import find_traces

_ABOUT = """\
`{command}`. {replays} replays of each of {num_homes} homes ({others} in long lives), with other
looks and questions; all of it is from these homes, and nothing was trained or chosen in this
command. A home is one unit of all statistics, however often it is played. A prior "counted in the
other homes" leaves out the home that is played. Where the policy says where the robot looks, one
that guesses badly also sees less; on patrol all read the same memory. *Right if away*: among
questions about things that are not where this agent saw them last. *Right if out of place*: among
those about things that are not where they have been most of the time so far, the same questions for
all. NLL, calibration error and looks: less is better. `oracle` knows how often each thing is put at
each place, the future included.
[docs/traces.md](../docs/traces.md#the-benchmark-of-recorded-homes) says more."""
_ABOUT_LEFT_OUT = " {names}: networks that were each trained in the other homes."


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.recorded",
        "Play all policies and some networks in recorded homes: episodes from an empty memory and "
        "long lives, looking where the policy says and on patrol, with both priors that ship and "
        "one counted in the other homes. Run again to resume, or to add networks: what has been "
        "played is in the JSON file beside the table.",
    )
    parser.add_argument(
        "--trace",
        type=tuple[str, ...],
        default=(),
        help="two or more recorded homes, or folders of them",
    )
    add_table_options(parser, "recorded_homes.md", ("heat",))
    parser.add_argument(
        "--left_out",
        type=tuple[str, ...],
        default=(),
        help="NAME=SOURCE of networks that were each trained without one home, {home} in SOURCE: "
        "every home is played by that which has not seen it",
    )
    parser.add_argument(
        "--also_prior",
        type=tuple[str, ...],
        default=(),
        help="NAME=FILE of further priors, each with kinds of its own: of word vectors, or filled "
        "in by a language model (docs/priors.md)",
    )
    parser.add_argument(
        "--kinds", type=tuple[str, ...] | None, help="names of kinds; all if left out"
    )
    parser.add_argument("--steps", type=int, default=200, help="of an episode")
    parser.add_argument("--step_seconds", type=float, default=3600.0, help="length of a step")
    parser.add_argument(
        "--replays", type=int, default=4, help="of each home in episodes, half as many in lives"
    )
    return parser


def _play(options: Namespace, path: Path) -> Played:
    """Let everybody play what has not been played yet."""
    checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
    also = {}
    for text in options.also_prior:
        name, _, source = text.partition("=")
        if not name.isidentifier() or not source:
            raise ValueError(
                f"also_prior must be NAME=FILE, got {shorten(text)}. Name it in letters, digits "
                "and underscores."
            )
        also[name] = load_prior(source)
    kinds = list_benchmark(
        options.trace, options.steps, options.step_seconds, options.replays, also
    )
    kinds = choose_kinds(kinds, options.kinds)
    left_out = [LeftOut.parse(text) for text in options.left_out]
    checksums = {}
    for several in left_out:
        found = [several.find(folder.name) for folder in find_traces(options.trace)]
        for point in found:
            point.load()  # what is missing is missed now
        checksums[several.name] = " ".join(point.compute_checksum() for point in found)
    others = {several.name: several.make for several in left_out}
    return play_all(kinds, checkpoints, path, others, checksums)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = _make_parser()
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(1, steps=options.steps, replays=options.replays)
        check_step_seconds(options.step_seconds)
        path = find_scores(options.out)
        left_out = [text.partition("=")[0] for text in options.left_out]
        networks = list_names(options.checkpoint)
        if options.play:
            played = _play(options, path)
        else:
            played = Played.load_all(path, options.kinds, [])
        scores = {name: played.scores[name] for name in options.kinds or played.about}
        titles = {name: played.about[name]["title"] for name in scores}
        units = next(iter(played.about.values()))["units"]
        about = _ABOUT.format(
            command=make_command(parser, options, networks),
            replays=options.replays, others=max(options.replays // 2, 1),
            num_homes=len(set(units)),
        )  # fmt: skip
        if left_out:
            about += _ABOUT_LEFT_OUT.format(names=", ".join(f"`{name}`" for name in left_out))
        parts = [f"# {options.called}", about]
        parts.append(f"## First guesses right\n\n{make_accuracy_table(scores)}")
        told = {name: scores[name] for name in titles if networks[0] in scores[name]}
        if told:
            compared = make_overview({name: played.about[name] for name in told}, told, networks[0])
            parts.append(f"## `{networks[0]}` beside the best rule\n\n{compared}")
        hours = {
            titles[name]: {who: own["by_hour"] for who, own in players.items()}
            for name, players in scores.items()
            if all("by_hour" in own for own in players.values())
        }
        if hours:
            image = io.BytesIO()
            draw_by_hour(hours).savefig(image, format="png", metadata={"Software": None})
            picture = options.out.with_name(f"{options.out.stem}_by_hour.png")
            write_whole(picture, image.getvalue())
            parts.append(f"## By the hour\n\n![Wrong guesses by the hour of day]({picture.name})")
        parts += [f"## {titles[name]}\n\n{make_table(own)}" for name, own in scores.items()]
        parts.append(describe_made(played, list(scores), [*networks, *left_out]))
        write_whole(options.out, ("\n\n".join(part.strip() for part in parts) + "\n").encode())
        print(options.out)


if __name__ == "__main__":
    run_main(main)
