"""Modules that are elsewhere now: an import of the old name says so."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

# Modules of the same name in another folder: the old folder, the new one, and the names.
_TO_FOLDERS = (
    ("nep", "tools", "claims headlines searches"),
    ("nep.bench.suites", "tools", "elsewhere searches"),
    ("nep.event_networks", "nep.bench.temporal", "plan report"),
    ("nep.layers", "nep.encoders", "gcn han heat hgt"),
    ("sgm.compiled", "sgm.evidence", "home_sums object_counts"),
    ("simulator", "sgm", "arrays checks evidence files lazy_names memory messages"),
    ("simulator.compiled", "simulator.world", "descriptions noise transitions"),
    ("simulator.policies", "sgm.policies", "adaptive exploring heuristics persistence"),
    ("simulator.policies", "sgm.policies", "policy"),
    ("simulator.priors", "sgm.prior", "household prior_check prior_graph"),
    ("simulator.robot_home", "tools.eyes", "measures results"),
)
# Folders and modules; what is inside a folder has the same name in the new one.
MOVED = {
    "sgm.memory.storage": "sgm.memory.memory_files",
    "sgm.memory.statement": "sgm.memory.thing",
    "sgm.arrays.sparse_counts": "sgm.arrays.read_numbers",
    "sgm.arrays.clone": "sgm.arrays.table",
    "sgm.memory.home_view": "sgm.memory.seen_and_said",
    "sgm.memory.frame_watch": "sgm.memory.step_log",
    "sgm.memory.coverage": "sgm.memory.sighting",
    "sgm.memory.table_content": "sgm.memory.columns",
    "nep.callbacks.random_states": "nep.callbacks.resume",
    "nep.checkpoint_files": "nep.callbacks.resume",
    "nep.setting_groups": "nep.config_files",
    "nep.players.left_out": "nep.players.contestants",
    "nep.players.starting_point": "nep.robot.fine_tuning",
    "nep.robot.comparison": "nep.robot.fine_tuning",
    "nep.bench.paper.stages": "nep.bench.paper.work",
    "nep.bench.paper.trained_plan": "nep.bench.paper.training",
    "nep.bench.best_rule": "nep.bench.comparisons",
    "nep.bench.temporal.kept_units": "nep.bench.temporal.plan",
    "nep.bench.paired_priors": "nep.bench.comparisons",
    "nep.bench.scoring_code": "nep.bench.game",
    "sgm.memory.candidates": "sgm.memory.queries",
    "sgm.memory.change": "sgm.memory.queries",
    "datamodules.mapped_table": "datamodules.snapshot_tables",
    "nep.encoders.dgl_encoder": "nep.encoders.encoder",
    "nep.event_networks.files": "nep.event_networks.registry",
    "nep.event_networks.message_store": "nep.event_networks.tgn",
    "nep.event_networks.tuning": "nep.event_networks.training",
    "nep.kinds": "nep.bench",
    "nep.layers.alike": "nep.encoders.encoder",
    "nep.layers.dropout": "nep.model.query_attention",
    "nep.layers.gelu": "nep.layers.ensemble_linear",
    "nep.layers.heads": "nep.encoders.encoder",
    "nep.layers.per_node_type": "nep.layers.equal_rows",
    "nep.model.evidence_embedding": "nep.model.embedding",
    "nep.model.hits_at_1": "nep.model.module",
    "nep.paper": "nep.bench.paper",
    "nep.players.calibration": "nep.players.calibration_searches",
    "nep.players.own_encoders": "nep.players.stored_network",
    "nep.players.searches": "nep.players.calibration_searches",
    "nep.bench.paper.readings": "tools.claims.readings",
    "nep.bench.elsewhere": "tools.elsewhere",
    "nep.bench.search_orders": "tools.searches.search_orders",
    "nep.report.searches": "nep.report.figures",
    "nep.report.code_version": "nep.report.results",
    "nep.report.search_pictures": "nep.report.figures",
    "nep.view.cones": "nep.view.plan_shapes",
    "nep.view.inputs": "nep.view.server",
    "nep.view.saved_page": "nep.view.document",
    "nep.view.sources": "nep.view.__main__",
    "nep.view.routes": "nep.view.plan_shapes",
    "nep.view.stage": "nep.view.page_state",
    "sgm.compiled.adaptive_filter": "sgm.evidence.adaptive_filter_kernel",
    "sgm.compiled.companions": "sgm.evidence.question",
    "sgm.compiled.kernel": "sgm.kernel",
    "sgm.compiled.leaving": "sgm.evidence.adaptive_filter_kernel",
    "sgm.compiled.look_likelihood": "sgm.belief.detector",
    "sgm.compiled.others": "sgm.evidence.question",
    "sgm.compiled.outings": "sgm.evidence.outings_kernel",
    "sgm.compiled.place_columns": "sgm.evidence.place_columns_kernel",
    "sgm.compiled.places": "sgm.evidence.place_columns_kernel",
    "sgm.compiled.question_columns": "sgm.evidence.question_columns_kernel",
    "sgm.compiled.sighting_columns": "sgm.evidence.place_columns_kernel",
    "sgm.serve.metrics": "sgm.serve.application",
    "sgm.serve.turns": "sgm.serve.caller",
    "simulator.compiled.dynamics": "simulator.world.paper_dynamics",
    "simulator.compiled.filters": "simulator.policies.filter_kernel",
    "simulator.compiled.homes": "simulator.world.paper_dynamics",
    "simulator.compiled.routine": "simulator.world.routine.life_kernel",
    "simulator.compiled.routine_places": "simulator.world.routine.life",
    "simulator.compiled.streams": "simulator.world.streams",
    "simulator.compiled.usual_places": "simulator.tasks.usual_places",
    "sgm.evidence.features": "sgm.evidence.evidence_features",
    "sgm.evidence.expected": "sgm.evidence.expected_places",
    "sgm.eyes.assignment": "sgm.eyes.placing",
    "sgm.eyes.depth_image": "sgm.eyes.camera_view",
    "sgm.eyes.gate": "sgm.eyes.look_rules",
    "sgm.eyes.located": "sgm.eyes.detection",
    "sgm.eyes.seen_points": "sgm.eyes.visits",
    "sgm.arrays.ragged": "sgm.arrays.grouped",
    "sgm.arrays.padded": "sgm.arrays.grouped",
    "sgm.layout.furniture_names": "sgm.layout.layout",
    "sgm.memory.asking_kernel": "sgm.memory.asking",
    "sgm.memory.questions": "sgm.memory.asking",
    "sgm.memory.time_steps": "sgm.memory.clock",
    "sgm.memory.apply_corrections": "sgm.memory.corrections",
    "sgm.memory.log_lock": "sgm.memory.locks",
    "sgm.memory.save_lock": "sgm.memory.locks",
    "sgm.memory.logged_state": "sgm.memory.memory_files",
    "sgm.memory.identity": "sgm.memory.sighting",
    "sgm.memory.memory_names": "sgm.memory.memory_identities",
    "sgm.memory.thing_name": "sgm.memory.thing",
    "sgm.finder.tour": "sgm.finder.search_plan",
    "sgm.finder.said_moves": "sgm.finder.judged",
    "sgm.finder.listings": "sgm.finder.read_calls",
    "sgm.finder.where": "sgm.finder.read_calls",
    "sgm.layout.approach": "sgm.layout.furniture",
    "sgm.names.name_words": "sgm.names.words",
    "sgm.network.retired": "sgm.network.shipped",
    "sgm.network.sharing": "sgm.network.policy",
    "sgm.network.step_answers": "sgm.network.policy",
    "simulator.policies.last_seen": "sgm.policies.heuristics",
    "sgm.policies.last_seen": "sgm.policies.heuristics",
    "simulator.policies.probabilities": "sgm.policies.policy",
    "sgm.policies.probabilities": "sgm.policies.policy",
    "simulator.policies.two_states": "sgm.policies.persistence",
    "sgm.policies.two_states": "sgm.policies.persistence",
    "simulator.priors.tables": "sgm.files",
    "sgm.prior.tables": "sgm.files",
    "sgm.text.encoder": "sgm.text.tok2vec",
    "sgm.text.hashing": "sgm.text.tok2vec",
    "sgm.text.similar_words": "sgm.text.vectors",
    "sgm.finder.reasons": "sgm.finder.ranking",
    "sgm.text.spacy_encoder": "sgm.text.vectors",
    "sgm.names.names": "sgm.names.name_matching",
    "sgm.names.names_report": "tools.names",
    "simulator.policies.kept_beliefs": "simulator.policies.place_filter",
    "simulator.world.confidences": "simulator.world.sensing",
    "simulator.policies.belief": "simulator.policies.filter_kernel",
    "simulator.policies.look_log": "simulator.policies.filter_looks",
    "simulator.tasks.usual_place_kernel": "simulator.tasks.usual_places",
    "simulator.world.description_kernel": "simulator.world.descriptions",
    "simulator.world.noise_kernel": "simulator.world.noise",
    "simulator.world.slot_kernel": "simulator.world.paper_dynamics",
    "simulator.world.transition_kernel": "simulator.world.transitions",
    "simulator.priors.compare": "tools.priors.compare",
    "simulator.priors.sources": "tools.priors",
    "simulator.realism": "tools.realism",
    "simulator.replay.still": "simulator.replay.replay",
    "simulator.robot": "sgm.finder",
    "simulator.tasks.tour": "sgm.finder.search_plan",
    "sgm.text.alike": "sgm.text.vectors",
    "simulator.text.alike": "sgm.text.vectors",
    "simulator.text.train": "tools.text_training",
    "simulator.text.vectors": "sgm.text.vectors",
    "simulator.trace.memory": "simulator.trace.trace",
    "simulator.trace.truth": "simulator.trace.trace",
    "simulator.box_world.detector": "simulator.box_world.depth_camera",
    "simulator.box_world.solids": "simulator.box_world.ray_kernel",
    "simulator.box_world.things": "simulator.box_world.world",
    "simulator.drawing.belief": "simulator.drawing.home",
    "simulator.drawing.colours": "simulator.drawing.home",
    "simulator.drawing.pixels": "simulator.drawing.home",
    "simulator.events.collection": "simulator.events.recorder",
    "simulator.trace.importers.label_names": "simulator.trace.importers.scene_graph",
    "simulator.trace.importers.procthor_schema": "simulator.trace.importers.procthor",
    "simulator.trace.remembered_trace": "simulator.trace.trace",
    "simulator.trace.simulation_file": "simulator.trace.trace",
    "simulator.trace.types": "simulator.trace.recorded_homes",
    "simulator.world.paper_dynamics_kernel": "simulator.world.paper_dynamics",
    "simulator.world.initial_objects": "simulator.world.initial_homes",
    "simulator.world.initial_furniture": "simulator.world.initial_homes",
    "simulator.igridson.walk": "simulator.igridson.navigation",
    "simulator.igridson.layout_check": "simulator.igridson.layout",
    "simulator.igridson.play": "simulator.igridson.agent",
    "simulator.gym.find_object_vector_env": "simulator.gym.find_object_env",
    "simulator.world.stream_kernel": "simulator.world.streams",
    "simulator.world.mixture.words": "simulator.world.mixture.views",
    "simulator.world.routine.occasions": "simulator.world.routine.rules",
    "simulator.igridson.searchers": "simulator.igridson.find_object",
    "simulator.igridson.travel": "simulator.igridson.navigation",
    "simulator.igridson.command": "simulator.igridson.__main__",
    "simulator.world.mixture.mixture": "simulator.world.mixture.source",
    "simulator.priors.show": "simulator.priors.__main__",
    "simulator.world.routine.kinds": "simulator.world.routine.activity_kinds",
    **{
        f"{old}.{name}": f"{new}.{name}"
        for old, new, names in _TO_FOLDERS
        for name in names.split()
    },
    "sgm.evidence.place_features": "sgm.evidence.evidence_features",
    "sgm.evidence.question_features": "sgm.evidence.evidence_features",
    "sgm.evidence.rank_kernel": "sgm.evidence.place_columns_kernel",
    "sgm.evidence.sighting_columns_kernel": "sgm.evidence.place_columns_kernel",
    "simulator.policies.home_filter": "simulator.policies.filters",
    "simulator.policies.oracle": "simulator.policies.oracles",
    "simulator.policies.schedule_oracle": "simulator.policies.oracles",
    "simulator.replay.still_memory": "simulator.replay.replay",
    "simulator.replay.truth": "simulator.replay.story",
    "simulator.snapshots.shard_check": "simulator.snapshots.shards",
    "simulator.tasks.fingerprint": "simulator.test_sets.test_sets",
    "simulator.tasks.queries": "simulator.tasks.rollout",
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
