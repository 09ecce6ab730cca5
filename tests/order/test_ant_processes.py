"""Ants in processes: the answer equals that of threads and of a plain simulation; no worker outlives a run.

In the fast tests the workers are threads that exchange the same messages, since each process takes 0.4 s to start.
"""

from __future__ import annotations

import itertools
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from itertools import pairwise
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import OptionError, SolveError
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution
from leafcut.options import AcoOptions, FireflyOptions, SolveOptions
from leafcut.order.construction import random_states
from leafcut.order.instance import Instance, build_instance
from leafcut.order.literature import processes
from leafcut.order.literature.ants import initial_trails
from leafcut.order.literature.pheromone import AntParameters
from leafcut.order.literature.places import Places
from leafcut.order.literature.processes import AntProcesses
from leafcut.order.search import AlgorithmRun, Best
from leafcut.order.solve import solve
from leafcut.order.stop import Stop
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings, settings_for

N, ITERATIONS = 30, 6
PLACES = np.random.default_rng(1).uniform(0, 100, (N, 2))
PROBLEM = RoutingProblem.of_points(PLACES, closed=True)


@pytest.fixture(autouse=True)
def _no_worker_is_left() -> Iterator[None]:
    """Check that no worker process outlives a test."""
    yield
    assert active_children() == []


@pytest.fixture(params=["threads", pytest.param("processes", marks=pytest.mark.slow)])
def workers_are(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run workers in threads, and in the slow tier also in processes."""
    monkeypatch.setattr(processes, "PROCESSES", request.param)


def run(algorithm: str, parallel: str, workers: int = 2, seed: int = 1, **more: object) -> Solution:
    """Return the solution of a short search."""
    options = SolveOptions(
        algorithm=algorithm, iterations=ITERATIONS, local_search=False, bound=False, threads=1, seed=seed
    )
    return solve(PROBLEM, options, AcoOptions(parallel=parallel, n_processes=workers, n_ants=7), **more)


def master(instance: Instance, algorithm: str, workers: int, ants: int, parallel: str = "exchange") -> AntProcesses:
    """Return the master of workers that exchange their deposits."""
    aco = AcoOptions(parallel=parallel, n_processes=workers, n_ants=ants)
    run = AlgorithmRun(SolveOptions(algorithm=algorithm, seed=3), aco, FireflyOptions(), Best(Stop()))
    moves = Places(instance, False)
    return AntProcesses(
        moves, run, AntParameters.from_options(algorithm, aco, instance.n, False), moves.offer_first_solution(run.best)
    )


@pytest.mark.usefixtures("workers_are")
def test_a_master_with_workers_finds_the_answer_of_threads() -> None:
    for algorithm, workers in (("as", 2), ("mmas", 3)):
        ours, theirs = run(algorithm, "processes", workers), run(algorithm, "threads")
        assert ours.nodes.tolist() == theirs.nodes.tolist()
        assert ours.cost == theirs.cost
        assert [w.ants for w in ours.workers] == [len(range(k, 7, workers)) * ITERATIONS for k in range(workers)]


@pytest.mark.usefixtures("workers_are")
def test_directed_orders_keep_precedence_and_equal_those_of_threads() -> None:
    several = RoutingProblem(
        entry=PLACES,
        exit=PLACES + 1.0,
        cluster=np.arange(N, dtype=np.int32),
        service=np.zeros(N),
        precedence=np.array([[3, 2], [9, 4]], dtype=np.int32),
    )
    options = SolveOptions(algorithm="as", iterations=3, bound=False)
    found = [solve(several, options, AcoOptions(parallel=p, n_ants=6)) for p in ("threads", "processes", "exchange")]
    assert found[0].nodes.tolist() == found[1].nodes.tolist()
    order = found[2].nodes.tolist()
    assert sorted(order) == list(range(N))
    assert order.index(3) < order.index(2)
    assert order.index(9) < order.index(4)


class PlainAnts:
    """Ant System in plain Python: each colony has its own trails, a dict of edges, and adds the deposits of all."""

    def __init__(self, instance: Instance, c_nn: float, workers: int, ants: int, offset: float) -> None:
        self.xy, self.lists, self.offset = instance.cost.xy, instance.candidates.tolist(), offset
        self.workers, self.ants = workers, ants
        edges = [frozenset((i, j)) for i in range(instance.n) for j in range(i)]
        self.trails = [dict.fromkeys(edges, ants / c_nn) for _ in range(workers)]

    def length(self, i: int, j: int) -> float:
        return math.dist(self.xy[i], self.xy[j])

    @staticmethod
    def uniform(word: int) -> tuple[float, int]:
        """Return the next number of xorshift64 (13, 7, 17), and its state."""
        word ^= (word << 13) & (2**64 - 1)
        word ^= word >> 7
        word ^= (word << 17) & (2**64 - 1)
        return (word >> 11) / 2**53, word

    def tour(self, trails: dict[frozenset[int], float], word: int) -> list[int]:
        number, word = self.uniform(word)
        tour = [int(number * len(self.xy))]
        while len(tour) < len(self.xy):
            here, left = tour[-1], [j for j in self.lists[tour[-1]] if j >= 0 and j not in tour]
            weights = [trails[frozenset((here, j))] * (1.0 / (self.length(here, j) + self.offset)) ** 2 for j in left]
            number, word = self.uniform(word)
            reached = np.cumsum(weights) > number * sum(weights)
            j = left[int(np.argmax(reached))]
            tour.append(j)
        return tour

    def iterate(self, iteration: int) -> list[list[int]]:
        """Return the tours of an iteration in the order of the ants; then all colonies learn from all tours."""
        words = random_states(3, iteration, count=self.ants).tolist()
        tours = [self.tour(self.trails[ant % self.workers], words[ant]) for ant in range(self.ants)]
        steps = [[frozenset(pair) for pair in pairwise([*tour, tour[0]])] for tour in tours]
        lengths = [sum(self.length(a, b) for a, b in pairwise([*tour, tour[0]])) for tour in tours]
        for worker, trails in enumerate(self.trails):
            for edge in trails:
                trails[edge] *= 0.5
            for ant in sorted(
                range(self.ants), key=lambda ant: (ant % self.workers != worker, ant % self.workers, ant)
            ):
                for edge in steps[ant]:
                    trails[edge] += 1.0 / lengths[ant]
        return tours


def test_processes_that_exchange_deposits_agree_with_a_plain_simulation() -> None:
    instance = build_instance(RoutingProblem.of_points(PLACES[:12], closed=True), 0)
    with closing(master(instance, "as", workers=2, ants=5)) as ants:
        start = ants.colonies[0]
        offset = initial_trails(ants.moves, start.parameters, start.c_nn, 3).offset
        plain = PlainAnts(instance, start.c_nn, 2, 5, offset)
        for iteration in range(8):
            tours, costs = ants.construct(iteration)
            expected = plain.iterate(iteration)
            assert tours.tolist() == expected
            assert costs == pytest.approx([sum(plain.length(a, b) for a, b in pairwise([*t, t[0]])) for t in expected])


@pytest.mark.usefixtures("workers_are")
@pytest.mark.parametrize("algorithm", ["mmas", "acs"])
def test_separate_pheromone_diverges_as_in_a_sequential_simulation(algorithm: str) -> None:
    """The same three workers run in turn in this process, and messages are passed by hand."""
    instance = build_instance(PROBLEM, 8)
    laid: list[list] = [[], [], []]
    with closing(master(instance, algorithm, workers=3, ants=7)) as ants:
        workers = ants.colonies
        for iteration in range(ITERATIONS):
            tours, costs = ants.construct(iteration)
            others = [[c for j in range(3) if j != k for c in laid[j]] for k in range(3)]
            answers = [w.run_iteration(iteration, math.inf, None, others[k]) for k, w in enumerate(workers)]
            laid = [changes for _, _, changes, _ in answers]
            for k, (own_tours, own_costs, *_) in enumerate(answers):
                assert np.array_equal(tours[k::3], own_tours)
                assert np.array_equal(costs[k::3], own_costs)
    assert not np.allclose(workers[0].ants.trails.pheromone, workers[1].ants.trails.pheromone, rtol=1e-3)


def test_each_worker_sends_its_deposits_to_one_random_other() -> None:
    with closing(master(build_instance(PROBLEM, 8), "as", workers=4, ants=8, parallel="partners")) as ants:
        drawn = [ants.senders(iteration) for iteration in range(300)]
        assert drawn == [ants.senders(iteration) for iteration in range(300)]
    counts = np.zeros((4, 4), dtype=int)
    for senders in drawn:
        assert sorted(itertools.chain.from_iterable(senders)) == [0, 1, 2, 3]
        for k, received in enumerate(senders):
            counts[k, received] += 1
    assert np.diagonal(counts).tolist() == [0] * 4
    assert counts[~np.eye(4, dtype=bool)] == pytest.approx(100, abs=40)


@pytest.mark.usefixtures("workers_are")
def test_two_partners_exchange_like_two_workers_that_send_to_all_and_a_single_worker_has_no_partner() -> None:
    both = run("as", "exchange", 2), run("as", "partners", 2)
    assert both[0].nodes.tolist() == both[1].nodes.tolist()
    single = run("as", "exchange", 1), run("as", "partners", 1)
    assert single[0].nodes.tolist() == single[1].nodes.tolist()


@pytest.mark.usefixtures("workers_are")
@pytest.mark.parametrize("parallel", ["exchange", "partners"])
def test_the_same_seed_and_number_of_workers_give_the_same_answer(parallel: str) -> None:
    first, again, other = (run("acs", parallel, workers=3, seed=seed) for seed in (1, 1, 2))
    assert first.nodes.tolist() == again.nodes.tolist()
    assert first.history[-1][1] == again.history[-1][1]
    assert [w.best for w in first.workers] != [w.best for w in other.workers]


@pytest.mark.usefixtures("workers_are")
def test_ctrl_c_and_a_cancelled_run_keep_the_best_and_an_error_is_passed_on() -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    def fail(*_: object) -> None:
        raise ValueError("not of leafcut")

    cancelled = threading.Event()
    found = run("as", "exchange", progress=lambda *_: cancelled.set(), cancelled=cancelled)
    assert sorted(found.nodes.tolist()) == list(range(N))
    assert found.stopped_early
    assert sorted(run("as", "processes", progress=interrupt).nodes.tolist()) == list(range(N))
    with pytest.raises(ValueError, match="not of leafcut"):
        run("as", "processes", progress=fail)


@pytest.mark.usefixtures("workers_are")
def test_a_worker_that_fails_is_reported_in_one_line() -> None:
    with (
        closing(master(build_instance(PROBLEM, 8), "as", workers=2, ants=4)) as ants,
        pytest.raises(SolveError, match=r"^worker process [12] failed \(ValueError: [^\n]*$"),
    ):
        ants.construct(-1)


@pytest.mark.slow
def test_a_worker_that_is_killed_is_reported_in_one_line() -> None:
    with closing(master(build_instance(PROBLEM, 8), "as", workers=2, ants=4)) as ants:
        ants.construct(0)
        os.kill(ants.executors[1].submit(os.getpid).result(), signal.SIGKILL)
        with pytest.raises(SolveError, match=r"^worker process 2 of 2 ended; run again, [^\n]*$"):
            for iteration in itertools.count(1):
                ants.construct(iteration)


def test_a_worker_whose_time_is_over_reports_no_cost_and_learns_nothing() -> None:
    (worker,) = master(build_instance(PROBLEM, 8), "mmas", workers=1, ants=4).colonies
    before = worker.ants.trails.pheromone.copy()
    _, costs, changes, _ = worker.run_iteration(1, -1.0, None, [])
    assert np.isinf(costs).any()
    assert changes == []
    assert np.array_equal(worker.ants.trails.pheromone, before)


@pytest.mark.slow
def test_a_time_limit_ends_workers_that_would_need_hours_for_one_iteration() -> None:
    options = SolveOptions(algorithm="as", time_limit=2.0, local_search=False, bound=False)
    found = solve(PROBLEM, options, AcoOptions(parallel="exchange", n_ants=1_000_000))
    assert sorted(found.nodes.tolist()) == list(range(N))
    assert found.iterations == 0


def count_of(group: int, wanted: range) -> int:
    """Return the number of processes of a group as soon as it is in a range; give up after five minutes."""
    for _ in range(3000):
        found = subprocess.run(["pgrep", "-g", str(group)], capture_output=True, text=True, check=False).stdout.split()
        if len(found) in wanted:
            break
        time.sleep(0.1)
    return len(found)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there are no process groups to send a signal to")
def test_ctrl_c_on_the_command_line_ends_all_processes_and_answers(tmp_path: Path) -> None:
    """Four processes: the command, Python's resource tracker and two workers."""
    tour = tmp_path / "best.tour"
    command = f"solve random:60 --algorithm as --iterations 10000000 --parallel processes --no-bound --tour {tour}"
    # Tests in the background ignore Ctrl-C, and their child processes would inherit that.
    listens = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    begin = f"{listens}; from leafcut.cli.app import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", begin, *command.split()],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as job:
        try:
            assert count_of(job.pid, range(4, 99)) == 4
            os.killpg(job.pid, signal.SIGINT)
            _, said = job.communicate(timeout=300)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(job.pid, signal.SIGKILL)
    assert "Traceback" not in said
    assert job.returncode == 0
    assert tour.read_text().count("\n") > 60
    assert count_of(job.pid, range(1)) == 0


def test_options_without_effect_are_refused() -> None:
    with pytest.raises(SolveError, match="the ants of acs update the shared pheromone in turn"):
        run("acs", "processes")
    with pytest.raises(OptionError, match="--n-processes: only used with --parallel processes, exchange or partners"):
        settings_for(collect_settings({"algorithm": "as", "n_processes": 3}), registry.work("drill"))
    with pytest.raises(OptionError, match="--parallel: only used with --algorithm"):
        settings_for(collect_settings({"parallel": "exchange"}), registry.work("drill"))
