"""All that is tried, by name."""

from __future__ import annotations

import commands
import sessions
import targets
import writers

TARGETS = {
    **targets.TARGETS,
    "session": targets.Target(sessions.make_session, sessions.change_session, sessions.use_session),
    "command": targets.Target(commands.make_inputs, commands.change_line, commands.use_line),
    "writing": targets.Target(writers.make_all, writers.change_plan, writers.use_plan),
}
