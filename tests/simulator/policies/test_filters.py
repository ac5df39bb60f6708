import numpy as np
import pytest

from sgm.memory.queries import Change
from simulator.policies import make_policy
from simulator.policies.filter_kernel import Rules
from simulator.policies.filter_looks import FilterLooks
from simulator.policies.filters import Ceiling, HomeFilter, PriorFilter
from simulator.policies.place_filter import KeptBeliefs, PlaceFilter
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
ROOM = [0, 0, 0, 1, 1, 1]


class FixedFilter(PlaceFilter):
    """A filter with rules given by hand, the same for every object."""

    def __init__(self, prior, config, rules):
        super().__init__(prior, config)
        self.rules = rules

    def read_moves(self, memory, queries):
        return np.stack([self.rules.moves] * len(queries.home))

    def read_type_moves(self, memory, home, types):
        return np.stack([self.rules.moves] * len(home))

    def compute_rules(self, subjects):
        return Rules(*(np.stack([value] * len(subjects.home)) for value in self.rules))


def make_rules(moves, initial=None, move=0.2, asked=0.5, remove=0.0, add=0.0, miss=0.25):
    return Rules(
        moves=np.array(moves, dtype=float),
        initial=np.array(initial if initial is not None else [0] * 6, dtype=float),
        move_rate=np.array(move),
        asked_move_rate=np.array(asked),
        remove_rate=np.array(remove),
        add_rate=np.array(add),
        miss_rate=np.array(miss),
    )


def look(policy, memory, furniture, is_seen, home=0, coverage=1.0):
    row = memory.ensure_objects(*(np.array([value]) for value in (home, 7, 11, 0)))[: int(is_seen)]
    change = memory.observe(
        np.array([home]), np.array([furniture]), row, np.ones(len(row), int), np.array([coverage])
    )
    policy.observe(memory, change)


def ask(policy, memory, home=0):
    queries = memory.query(*(np.array([value]) for value in (home, 7, 11, 0)))
    return policy.scores(memory, queries)[0]


def test_one_object_by_hand(make_tiny_memory, tiny_prior):
    """Moves lead to the shelf and to the table alike; (fridge, shelf, table):

    t=1 seen on the table:   (0, 0, 1)
    t=2 not asked, moves with 0.2: the table's only other place is the shelf
                             (0, 0.2, 0.8)
        looked at the table, not there (a miss keeps 1/4): 0.8 -> 0.2, total 0.4
                             (0, 0.5, 0.5)
    t=3 asked for, moves with 0.5: half of each changes places
                             (0, 0.5 x 0.5 + 0.5 x 0.5, ...) = (0, 0.5, 0.5)
        looked at the shelf, not there: 0.5 -> 0.125, total 0.625
                             (0, 0.2, 0.8)
    t=4 asked for: 0.2 x 0.5 + 0.8 x 0.5 = 0.5
                             (0, 0.5, 0.5)
    """
    memory = make_tiny_memory()
    rules = make_rules([0, 0.5, 0.5, 0, 0, 0])
    policy = FixedFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")), rules)
    policy.reset(memory)
    memory.step()
    look(policy, memory, TABLE, True)
    memory.step()
    look(policy, memory, TABLE, False)
    memory.step()
    np.testing.assert_allclose(ask(policy, memory), [0, 0.5, 0.5, 0, 0, 0])
    look(policy, memory, SHELF, False)
    memory.step()
    np.testing.assert_allclose(ask(policy, memory), [0, 0.5, 0.5, 0, 0, 0])
    policy.reset(memory)  # other homes: nothing is known
    assert not ask(policy, memory).any()


def test_three_places_by_hand(make_tiny_memory, tiny_prior):
    """Moves: shelf 0.2, table 0.3, fridge 0.5, move rate 0.2, never asked for before t=3.

    t=1 seen in the fridge (1, 0, 0)
    t=2 0.2 leaves, to shelf : table = 2 : 3 -> (0.8, 0.08, 0.12)
        fridge looked at, not seen: 0.8 -> 0.2, total 0.4 -> (0.5, 0.2, 0.3)
    t=3 asked, rate 0.5. Leaving: 0.25, 0.10, 0.15.
        fridge: 0.25 + 0.10 x 5/8 + 0.15 x 5/7
        shelf:  0.10 + 0.25 x 2/5 + 0.15 x 2/7
        table:  0.15 + 0.25 x 3/5 + 0.10 x 3/8
    """
    memory = make_tiny_memory()
    rules = make_rules([0.5, 0.2, 0.3, 0, 0, 0])
    policy = FixedFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")), rules)
    policy.reset(memory)
    memory.step()
    look(policy, memory, FRIDGE, True)
    memory.step()
    look(policy, memory, FRIDGE, False)
    memory.step()
    fridge = 0.25 + 0.10 * 5 / 8 + 0.15 * 5 / 7
    shelf = 0.10 + 0.25 * 2 / 5 + 0.15 * 2 / 7
    table = 0.15 + 0.25 * 3 / 5 + 0.10 * 3 / 8
    assert fridge + shelf + table == pytest.approx(1)
    np.testing.assert_allclose(ask(policy, memory), [fridge, shelf, table, 0, 0, 0])


def test_objects_never_seen_are_a_density_that_looks_thin_out(make_tiny_memory, tiny_prior):
    """One object expected, 0.6 on the table and 0.4 on the bed; t=0: table looked at in vain.

    0.6 -> 0.15; 0.4 stays: a Poisson count elsewhere learns nothing from it. t=1, not asked for:
    it stays in its room and has no other place there. A tenth leaves; 0.05 appear, half on each:
    0.15 x 0.9 + 0.025 = 0.16 and 0.4 x 0.9 + 0.025 = 0.385.
    """
    memory = make_tiny_memory()
    rules = make_rules([0, 0, 0.5, 0.5, 0, 0], [0, 0, 0.6, 0.4, 0, 0], remove=0.1, add=0.05)
    policy = FixedFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")), rules)
    policy.reset(memory)
    look(policy, memory, TABLE, False)
    memory.step()
    np.testing.assert_allclose(ask(policy, memory), [0, 0, 0.16, 0.385, 0, 0])


@pytest.mark.slow
def test_a_sighting_elsewhere_may_be_another_instance(make_tiny_memory, tiny_prior):
    """t=0 seen on the bed: last (bed 1). Density of others: bed 0.2 -> 0.05 missed, table 0.3.

    t=1, no moves: seen on the table. The one of the bed cannot be there: it is another one, and
    the one of the bed still is somewhere: others gain 1 on the bed; table others 0.3 -> 0.075.
    """
    memory = make_tiny_memory()
    rules = make_rules([0, 0, 0.5, 0.5, 0, 0], [0, 0, 0.3, 0.2, 0, 0], move=0, asked=0)
    policy = FixedFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")), rules)
    policy.reset(memory)
    look(policy, memory, BED, True)
    memory.step()
    look(policy, memory, TABLE, True)
    memory.step()
    np.testing.assert_allclose(ask(policy, memory), [0, 0, 1.075, 1.05, 0, 0])


@pytest.mark.slow
def test_what_was_out_of_view_is_not_missed(make_tiny_memory, tiny_prior):
    """On the table or the shelf, 0.5 each; 40 % of the table is in view, a look misses 1/4 of that.

    Not seen: 0.6 + 0.4 x 0.25 = 0.7 of the half is left: 0.35 / 0.85 there, 0.5 / 0.85 elsewhere.
    """
    memory = make_tiny_memory()
    rules = make_rules([0, 0.5, 0.5, 0, 0, 0], move=0.5, asked=0)
    policy = FixedFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")), rules)
    policy.reset(memory)
    look(policy, memory, TABLE, True)
    memory.step()
    look(policy, memory, TABLE, False, coverage=0.4)
    memory.step()
    np.testing.assert_allclose(ask(policy, memory), [0, 0.5 / 0.85, 0.35 / 0.85, 0, 0, 0])


def follow_plainly(rules, cross_room, events, asked_times, miss=0.25):
    """The same filter with a dense transition matrix, for one object and one home."""
    num = len(rules.moves)
    last, others = np.zeros(num), rules.initial.copy()
    for time, looks in events:
        if time > 0:
            rate = rules.asked_move_rate if time in asked_times else rules.move_rate
            transition = np.zeros((num, num))
            for source in range(num):
                targets = [
                    target
                    for target in range(num)
                    if target != source and (cross_room or ROOM[target] == ROOM[source])
                ]
                total = sum(rules.moves[target] for target in targets)
                transition[source, source] = 1 - rate if total > 0 else 1
                for target in targets:
                    if total > 0:
                        transition[source, target] = rate * rules.moves[target] / total
            last = (1 - rules.remove_rate) * (last @ transition)
            others = (1 - rules.remove_rate) * (others @ transition)
            others = others + rules.add_rate * rules.moves
        for place, is_seen in looks:
            if is_seen:
                here = last[place] / (last[place] + others[place])
                others[place] *= miss
                others = others + (1 - here) * last
                last = np.eye(num)[place]
            else:
                likelihood = np.where(np.arange(num) == place, miss, 1.0)
                gone = 1 - last.sum()  # removed since it was seen
                last = last * likelihood / ((last * likelihood).sum() + gone)
                others = others * likelihood
    return last + others


@pytest.mark.parametrize("cross_room", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_equal_to_a_dense_filter_in_plain_loops(make_tiny_memory, tiny_prior, seed, cross_room):
    rng = np.random.default_rng(seed)
    memory = make_tiny_memory(2)
    moves = rng.random(6) * [1, 1, 1, 1, 0, 1]
    rules = make_rules(moves / moves.sum(), rng.random(6), 0.15, 0.55, remove=0.02, add=0.03)
    config = HomeConfig(rooms=("kitchen", "bedroom"), cross_room_moves=cross_room)
    policy = FixedFilter(tiny_prior, config, rules)
    policy.reset(memory)
    events, asked = [[(0, [])], [(0, [])]], [set(), set()]
    for time in range(1, 25):
        memory.step()
        for home in range(2):
            events[home].append((time, []))
        for home in range(2):
            if rng.random() < 0.5:
                asked[home].add(time)
                expected = follow_plainly(rules, cross_room, events[home], asked[home])
                np.testing.assert_allclose(ask(policy, memory, home), expected, atol=1e-9)
        for home in range(2):
            place, is_seen = int(rng.integers(6)), bool(rng.random() < 0.4)
            look(policy, memory, place, is_seen, home)
            events[home][-1][1].append((place, is_seen))


def test_rates_by_hand(make_tiny_memory, tiny_prior):
    """The move race: sum over types of count x (1 - exp(-kappa w)) = 5 % of the objects."""
    memory = make_tiny_memory()
    policy = PriorFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")))
    policy.reset(memory)
    # Expected objects: 6 per furniture node, shared in proportion to prior x sample_prob.
    count = policy._inventory.expected[0]
    np.testing.assert_allclose(count.sum(axis=0), 6)
    # Fridge: milk 0.8 x 0.5 = 0.4, apple 0.4 x 0.6 = 0.24 -> 6 x 5/8 and 6 x 3/8
    np.testing.assert_allclose(count[[1, 5], FRIDGE], [3.75, 2.25], rtol=1e-6)
    move, asked, remove, add = policy._inventory.compute_rates(np.zeros(10, int), np.arange(10))
    total = count.sum(axis=1)
    assert (total * move).sum() == pytest.approx(0.05 * 36)
    assert move[3] == asked[3] == 0  # lamps
    assert (asked[[0, 1, 2]] > move[[0, 1, 2]]).all()
    # Bayes: P(moved | asked) with P(asked | moved) = 0.5 / 1.8 + 0.5 w / sum of w, else only the
    # second term.
    weight = np.array([row.move_freq for row in tiny_prior.objects])
    second = 0.5 * weight / (total * weight).sum()
    joint = move * (0.5 / 1.8 + second)
    used = weight > 0
    bayes = joint[used] / (joint[used] + (1 - move[used]) * second[used])
    np.testing.assert_allclose(asked[used], bayes, rtol=1e-6)
    # What leaves in a step comes back on average (under any description).
    same = policy._inventory.sameness
    assert (remove * total).sum() == pytest.approx((add / same).sum())


def test_static_nodes_neither_come_nor_go(make_tiny_memory, tiny_prior):
    policy = PriorFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom"), dynamic_nodes=False))
    policy.reset(make_tiny_memory())
    _, _, remove, add = policy._inventory.compute_rates(np.zeros(10, int), np.arange(10))
    assert not remove.any()
    assert not add.any()


def test_prior_filter_starts_from_the_prior_and_spreads_the_unknown(make_tiny_memory, tiny_prior):
    memory = make_tiny_memory()
    policy = PriorFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")))
    policy.reset(memory)
    milk = memory.query(*(np.array([value]) for value in (0, 7, 11, 1)))
    scores = policy.scores(memory, milk)[0]
    # Fridge 3.75 (above); table: milk 0.2 x 0.5 = 0.1 of mug 0.32, milk 0.1, plate 0.27, apple
    # 0.24, pen 0.125, phone 0.2 x 0.4 = 0.08 -> 6 x 0.1 / 1.135
    np.testing.assert_allclose(scores, [3.75, 0, 0.6 / 1.135, 0, 0, 0], rtol=1e-5)
    strange = memory.query(*(np.array([value]) for value in (0, 8, 11, -1)))
    scores = policy.scores(memory, strange)[0]
    assert np.ptp(scores) < 1e-9 < scores[0]


def test_the_ceiling_knows_how_sure_it_is(make_default_homes):
    """Homes without comings and goings: a score is the expected number of objects there."""
    homes = make_default_homes(30, seed=3, dynamic_nodes=False)
    rollout = Rollout(homes, Ceiling(homes))
    rows = np.arange(30)
    said, truth = [], []
    for step in predict_locations(rollout, 60):
        code = rollout.memory.objects["key"][step.queries.object]
        is_single = ((homes.object_code == code[:, None]) & homes.is_present).sum(axis=1) == 1
        was_seen = rollout.memory.objects["num_observed"][step.queries.object] > 0
        chosen = is_single & was_seen
        said.extend(step.scores[rows, step.choice][chosen])
        truth.extend(step.is_correct[chosen])
    assert len(said) > 300
    error = np.sqrt(0.25 / len(said))
    assert np.mean(np.minimum(said, 1)) == pytest.approx(np.mean(truth), abs=3 * error)


def test_looks_of_other_homes_do_not_matter(make_tiny_memory, tiny_prior):
    memory = make_tiny_memory(2)
    policy = PriorFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")))
    policy.reset(memory)
    memory.step()
    before = ask(policy, memory, home=0)
    look(policy, memory, TABLE, True, home=1)
    np.testing.assert_array_equal(ask(policy, memory, home=0), before)
    none = np.zeros(0, dtype=int)
    policy.observe(memory, Change(none, none, none, none, none.astype(bool), none))
    np.testing.assert_array_equal(ask(policy, memory, home=0), before)


def play_beside(homes, policies, num_steps):
    """Look at random places and ask three policies the same: their beliefs by step."""
    rollout = Rollout(homes, policies[0])
    for policy in policies[1:]:
        policy.reset(rollout.memory)
    rollout.on_change = lambda change: [
        policy.observe(rollout.memory, change) for policy in policies[1:]
    ]
    rng = np.random.default_rng(0)
    found = []
    for _ in range(num_steps):
        _, queries = rollout.ask()
        found.append([policy.follow(rollout.memory, queries) for policy in policies])
        rollout.look(rng.integers(0, homes.num_furniture, homes.num_homes))
    return found


class Replay(PriorFilter):
    """Keeps no belief: every question plays the whole past again."""

    def follow(self, memory, queries):
        self._kept = KeptBeliefs(self.num_rows, memory.num_furniture, self.num_basis)
        return super().follow(memory, queries)


def test_a_cut_log_and_kept_beliefs_change_nothing(make_default_homes):
    """To the last bit: kept beliefs, a log that is cut every 20 steps, and the whole past."""
    homes = make_default_homes(3, seed=2)
    policies = [cls(homes.prior, homes.configs) for cls in (PriorFilter, Replay, PriorFilter)]
    original = policies[2].reset

    def reset(memory):
        original(memory)
        policies[2]._log.max_length = 40

    policies[2].reset = reset
    for kept, replayed, cut in play_beside(homes, policies, 150):
        np.testing.assert_array_equal(kept, replayed)
        np.testing.assert_array_equal(cut, replayed)
    assert policies[2]._log.start > 100


@pytest.mark.slow
def test_a_long_life_costs_no_more_than_a_short_one(make_tiny_homes, monkeypatch):
    """What a filter keeps: the log, beliefs of the objects, and nothing that grows with time."""
    monkeypatch.setattr(FilterLooks, "max_length", 64)
    homes = make_tiny_homes(2)
    for name in ("prior_filter", "home_filter", "ceiling"):
        policy = make_policy(name, homes)
        rollout = Rollout(homes, policy)
        sizes = []
        for _ in predict_locations(rollout, 400):
            log = policy._log
            chains = (log.looks, log.sightings, log.type_sightings, log.questions)
            sizes.append([len(log.round_time), *(len(chain) for chain in chains)])
            assert memory_time_is_covered(log, rollout.memory.time)
        half = len(sizes) // 2
        assert (np.max(sizes[half:], axis=0) <= 1.2 * np.max(sizes[:half], axis=0)).all()
        assert policy._kept._entries.num_rows <= rollout.memory.objects.num_rows


def memory_time_is_covered(log, time):
    return log.start < time <= log.start + log.max_length


def test_rules_are_those_of_each_home(make_tiny_memory, tiny_prior):
    """Two homes of unequal rules: each as if both had its own."""
    configs = [
        HomeConfig(rooms=("kitchen", "bedroom"), detection_error=0.1, move_share=0.2),
        HomeConfig(
            rooms=("kitchen", "bedroom"),
            dynamic_nodes=False,
            cross_room_moves=True,
            objects_per_furniture=2,
            noise_zero_prob=0.5,
        ),
    ]
    for cls in (PriorFilter, HomeFilter):
        answers = []
        for rules in (configs, configs[0], configs[1]):
            memory = make_tiny_memory(2)
            policy = cls(tiny_prior, rules)
            policy.reset(memory)
            for time in range(6):
                memory.step()
                for home in range(2):
                    look(policy, memory, time, time == 1, home)
            memory.step()
            answers.append([ask(policy, memory, home) for home in range(2)])
        np.testing.assert_array_equal(answers[0][0], answers[1][0])
        np.testing.assert_array_equal(answers[0][1], answers[2][1])
        assert not np.allclose(answers[0][0], answers[0][1])
