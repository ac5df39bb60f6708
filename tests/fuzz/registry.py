"""All that is tried, by name."""

from __future__ import annotations

import commands
import idle
import imports
import machines
import many_threads
import near_names
import owners
import page_requests
import serve_requests
import special_files
import targets
import torch_files
import writers
import yaml_files

TARGETS = {
    **targets.TARGETS,
    "machine": targets.Target(machines.make_seed, machines.change_seed, machines.use_seed),
    "command": targets.Target(commands.make_inputs, commands.change_line, commands.use_line),
    "writing": targets.Target(writers.make_all, writers.change_plan, writers.use_plan),
    **torch_files.TARGETS,
    "yaml": targets.Target(yaml_files.make_good, yaml_files.change, yaml_files.use),
    "page": targets.Target(page_requests.make_request, page_requests.change, page_requests.use),
    "serve": targets.Target(serve_requests.make_request, serve_requests.change, serve_requests.use),
    "threads": targets.Target(many_threads.make_plan, many_threads.change, many_threads.use),
    "names": targets.Target(near_names.make, near_names.change, near_names.use),
    "special": targets.Target(special_files.make_all, special_files.change, special_files.use),
    "links": targets.Target(owners.make_home, owners.change_plan, owners.use_links),
    "start": targets.Target(owners.make_home, owners.change_plan, owners.use_start),
    "import": targets.Target(imports.make_all, imports.change, imports.use),
    "idle": targets.Target(idle.make, idle.change, idle.use),
}
