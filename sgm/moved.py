"""Modules that are elsewhere now: an import of the old name says so."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

# What was moved: the old folder, the new one where it is another, and each name, with the new one
# where it is another. What is inside a folder that moved has the same name in the new one.
_MOVES = """
datamodules: mapped_table=snapshot_tables
nep: kinds=bench setting_groups=config_files
nep > nep.bench: paper
nep > nep.callbacks: checkpoint_files=resume
nep > tools: claims headlines searches
nep.bench: best_rule=comparisons paired_priors=comparisons scoring_code=game
nep.bench > tools: elsewhere
nep.bench > tools.searches: search_orders
nep.bench.paper: stages=work trained_plan=training
nep.bench.paper > tools.claims: readings
nep.bench.suites > tools: elsewhere searches
nep.bench.temporal: kept_units=plan
nep.callbacks: random_states=resume
nep.encoders: dgl_encoder=encoder
nep.event_networks > nep.bench.temporal: plan report
nep.event_networks: files=registry message_store=tgn tuning=training
nep.layers > nep.encoders: alike=encoder gcn han heads=encoder heat hgt
nep.layers: gelu=ensemble_linear per_node_type=equal_rows
nep.layers > nep.model: dropout=query_attention
nep.model: evidence_embedding=embedding hits_at_1=module
nep.players: calibration=calibration_searches left_out=contestants own_encoders=stored_network
nep.players: searches=calibration_searches
nep.players > nep.robot: starting_point=fine_tuning
nep.report: code_version=results search_pictures=figures searches=figures
nep.robot: comparison=fine_tuning
nep.view: cones=plan_shapes inputs=server routes=plan_shapes saved_page=document sources=__main__
nep.view: stage=page_state
sgm.arrays: clone=table padded=grouped ragged=grouped sparse_counts=read_numbers
sgm.evidence: expected=expected_places features=evidence_features place_features=evidence_features
sgm.evidence: question_features=evidence_features rank_kernel=place_columns_kernel
sgm.evidence: sighting_columns_kernel=place_columns_kernel
sgm.eyes: assignment=placing depth_image=camera_view gate=look_rules located=detection
sgm.eyes: seen_points=visits
sgm.finder: listings=read_calls reasons=ranking said_moves=judged tour=search_plan where=read_calls
sgm.layout: approach=furniture furniture_names=layout
sgm.memory: apply_corrections=corrections asking_kernel=asking candidates=queries change=queries
sgm.memory: coverage=sighting frame_watch=step_log home_view=seen_and_said identity=sighting
sgm.memory: log_lock=locks logged_state=memory_files memory_names=memory_identities
sgm.memory: questions=asking save_lock=locks statement=thing storage=memory_files
sgm.memory: table_content=columns thing_name=thing time_steps=clock
sgm.names: name_words=words names=name_matching
sgm.names > tools: names_report=names
sgm.network: retired=shipped sharing=policy step_answers=policy
sgm.policies: last_seen=heuristics probabilities=policy two_states=persistence
sgm.prior > sgm: tables=files
sgm.serve: metrics=application turns=caller
sgm.text: alike=vectors encoder=tok2vec hashing=tok2vec similar_words=vectors spacy_encoder=vectors
simulator > sgm: arrays checks evidence files lazy_names memory messages robot=finder
simulator > tools: realism
simulator.box_world: detector=depth_camera solids=ray_kernel things=world
simulator.compiled > simulator.policies: filters=filter_kernel
simulator.compiled > simulator.tasks: usual_places
simulator.compiled > simulator.world: descriptions dynamics=paper_dynamics homes=paper_dynamics
simulator.compiled > simulator.world: noise streams transitions
simulator.compiled > simulator.world.routine: routine=life_kernel routine_places=life
simulator.drawing: belief=home colours=home pixels=home
simulator.events: collection=recorder
simulator.gym: find_object_vector_env=find_object_env
simulator.igridson: command=__main__ layout_check=layout play=agent searchers=find_object
simulator.igridson: travel=navigation walk=navigation
simulator.policies > sgm.policies: adaptive exploring heuristics last_seen=heuristics persistence
simulator.policies > sgm.policies: policy probabilities=policy two_states=persistence
simulator.policies: belief=filter_kernel home_filter=filters kept_beliefs=place_filter
simulator.policies: look_log=filter_looks oracle=oracles schedule_oracle=oracles
simulator.priors > sgm: tables=files
simulator.priors > sgm.prior: household prior_check prior_graph
simulator.priors: show=__main__
simulator.priors > tools: sources=priors
simulator.priors > tools.priors: compare
simulator.replay: still=replay still_memory=replay truth=story
simulator.robot_home > tools.eyes: measures results
simulator.snapshots: shard_check=shards
simulator.tasks > sgm.finder: tour=search_plan
simulator.tasks: queries=rollout usual_place_kernel=usual_places
simulator.tasks > simulator.test_sets: fingerprint=test_sets
simulator.text > sgm.text: alike=vectors vectors
simulator.text > tools: train=text_training
simulator.trace: memory=trace remembered_trace=trace simulation_file=trace truth=trace
simulator.trace: types=recorded_homes
simulator.trace.importers: label_names=scene_graph procthor_schema=procthor
simulator.world: confidences=sensing description_kernel=descriptions
simulator.world: initial_furniture=initial_homes initial_objects=initial_homes noise_kernel=noise
simulator.world: paper_dynamics_kernel=paper_dynamics slot_kernel=paper_dynamics
simulator.world: stream_kernel=streams transition_kernel=transitions
simulator.world.mixture: mixture=source words=views
simulator.world.routine: kinds=activity_kinds occasions=rules
"""
MOVED = {
    f"{old}.{name}": f"{new or old}.{new_name or name}"
    for folders, _, names in (line.partition(": ") for line in _MOVES.strip().splitlines())
    for old, _, new in [folders.partition(" > ")]
    for name, _, new_name in (each.partition("=") for each in names.split())
}


class _Moved(MetaPathFinder):
    """Refuses the old names; asked last, when there is no such module."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find nothing.

        Raises:
            ModuleNotFoundError: if the module has another name now.
        """
        known = name
        while known and known not in MOVED:
            known = known.rpartition(".")[0]
        if known:
            new = MOVED[known] + name.removeprefix(known)
            where = " in a checkout" if new.startswith("tools.") else ""
            raise ModuleNotFoundError(
                f"module must be imported by its new name, got {name}. Import {new}{where}.",
                name=name,
            )
        return None


def refuse_old_names() -> None:
    """Let imports of modules that have moved say where they are."""
    if not any(isinstance(finder, _Moved) for finder in sys.meta_path):
        sys.meta_path.append(_Moved())
