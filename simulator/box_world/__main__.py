"""Command line: `python -m simulator.box_world play`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from sgm.checks import check_at_least, check_seed
from sgm.finder.finder import Finder
from sgm.policies.adaptive import Adaptive
from simulator.box_world.robot_body import BodyRules
from simulator.box_world.robots import SeeingRobot
from simulator.box_world.week import Tally, Week, WeekRules
from simulator.command_line import add_home_arguments, choose, make_parser, parse, pick
from simulator.home_options import HomeOptions
from simulator.process import run_main

PROG = "python -m simulator.box_world"
# Homes with people that are no larger than flats, where nothing else is asked for.
USUAL_HOMES = {
    "home.furniture_per_room": 5,
    "home.objects_per_furniture": 3,
    "home.dynamics": {"class_path": "simulator.world.routine.dynamics.RoutineDynamics"},
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, and return the exit status: 0 if all is well, 1 on bad input."""
    return choose(PROG, {"play": play}, arguments)


def play(arguments: Sequence[str]) -> int:
    """Drive a robot through days with people: frames in, finds out."""
    parser = make_parser(
        f"{PROG} play",
        "Let a robot with a camera live in a home of boxes, beside one that is given perfect "
        "looks, and print what both find. Homes are those of all commands, with people by "
        "default; docs/box_world.md says what is simulated.",
    )
    add_home_arguments(parser)
    parser.set_defaults(USUAL_HOMES)
    parser.add_argument("--number", type=int, default=0, help="number of the home")
    parser.add_argument("--seed", type=int, default=0, help="of home, camera and errands")
    parser.add_class_arguments(WeekRules)
    parser.add_argument(
        "--position_sd", type=float, default=0.02, help="of the robot's known position, metres"
    )
    parser.add_argument("--ask", type=str | None, help="what to rank at the end; the last errand")
    parser.add_argument(
        "--save", type=Path | None, help="folder for home.sgm, which nep.view opens"
    )
    parser.add_argument("--quiet", type=bool, default=False, help="no progress bar")
    options = parse(parser, arguments)
    check_seed(options.seed)
    rules = WeekRules(**pick(options, WeekRules))
    check_at_least(0, position_sd=options.position_sd, number=options.number)
    source = HomeOptions(**pick(options, HomeOptions)).make()
    source.check_homes([options.number])
    source.check_steps(rules.steps)
    path = None
    if options.save is not None:
        options.save.mkdir(parents=True, exist_ok=True)
        path = options.save / "home.sgm"
        if path.exists():
            raise ValueError(
                f"save must be a folder without a memory, got {path}. Name another one, or move it."
            )
    body = BodyRules(position_sd=options.position_sd, angle_sd=options.position_sd / 4)
    week = Week(source, options.number, options.seed, rules, body, path)
    seeing = week.robots["eyes"]
    assert isinstance(seeing, SeeingRobot)
    world = seeing.world
    num_things = int((world.things.place >= 0).sum())
    print(
        f"{len(world.room_labels)} rooms, {world.num_furniture} pieces of furniture, {num_things} "
        f"things, {rules.steps} steps; a camera that knows its position to "
        f"{100 * options.position_sd:g} cm"
    )
    for _ in tqdm(week.live(), total=rules.steps, unit="step", disable=options.quiet):
        pass
    print(format_tallies(week.tallies, rules.most_looks))
    counts = seeing.builder.counts
    print("frames: " + ", ".join(f"{number} {name}" for name, number in counts.items()))
    asked = options.ask or week.tallies[0].errands[-1].description
    print(Finder(Adaptive()).rank(seeing.memory, asked, k=3))
    if options.save is not None:
        seeing.memory.close()
        print(f"saved: {path}")
    return 0


def format_tallies(tallies: Sequence[Tally], most_looks: int) -> str:
    """Return the finds of robots as a table."""
    lines = [f"{'robot':14} errands   found   looks   metres"]
    for tally in tallies:
        lines.append(
            f"{tally.name:14} {len(tally.errands):7} {tally.found:7.3f} "
            f"{tally.compute_looks(most_looks):7.2f} {tally.metres:8.1f}"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    run_main(main)
