"""Tally of a study: moments, quantiles of any number of replicates, and checkpoints of both kinds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.errors import A7SimError
from a7sim.study import checkpoint
from a7sim.study.checkpoint import KINDS, checkpoint_path, load, newest_checkpoint, save
from a7sim.study.quantile_sketch import CAPACITY, QuantileSketch
from a7sim.study.statistics import quantile_with_interval
from a7sim.study.tally import Tally
from tests.support.hypothesis_profile import examples

RNG = np.random.default_rng(3)


def test_moments_equal_those_of_numpy_and_exclude_sessions_that_gave_up():
    values = RNG.normal(1e6, 1e-3, (2, 500))
    values[1, ::7] = np.nan
    tally = Tally.empty(1, 2)
    for part in np.split(values, (1, 30, 400), axis=1):
        tally.add(0, part)
    assert tally.mean[0] == pytest.approx(np.nanmean(values, axis=1), rel=1e-14)
    assert tally.sd[0] == pytest.approx(np.nanstd(values, axis=1, ddof=1), rel=1e-6)
    assert tally.count[0].tolist() == [500, np.isfinite(values[1]).sum()]
    assert tally.low[0].tolist() == np.nanmin(values, axis=1).tolist()
    assert tally.high[0].tolist() == np.nanmax(values, axis=1).tolist()


def test_a_first_session_that_gave_up_and_a_constant_response_do_not_affect_the_moments():
    tally = Tally.empty(1, 2)
    tally.add(0, np.array([[np.nan], [0.1]]))
    tally.add(0, np.array([[3.0, 5.0], [0.1, 0.1]]))
    assert tally.count.tolist() == [[2, 3]]
    assert (tally.mean.tolist(), tally.sd.tolist()) == ([[4.0, 0.1]], [[2.0**0.5, 0.0]])


def test_the_sample_is_bounded_and_moments_and_quantiles_are_of_all(monkeypatch):
    monkeypatch.setattr("a7sim.study.tally.SAMPLE", 10)
    tally = Tally.empty(1, 1)
    for start in range(0, 28, 4):
        tally.add(0, np.arange(start, start + 4.0)[None])
    assert tally.sample(0).tolist() == [list(range(10))]
    assert (int(tally.done[0]), float(tally.mean[0, 0])) == (28, 13.5)
    assert quantile_with_interval(tally.spread(0, 0)[0], 0.95, tally.spread(0, 0)[1])[0] == 26.0


ORDERS = {
    "as drawn": np.array,
    "upwards": np.sort,
    "downwards": lambda values: -np.sort(-values),
    "from both ends": lambda values: np.sort(values)[np.argsort(np.abs(np.arange(values.size) - values.size / 2))],
    "few values": np.round,
}


@examples(40)
@given(
    seed=st.integers(0, 2**32),
    n=st.integers(1, 60 * CAPACITY),
    order=st.sampled_from(sorted(ORDERS)),
    cuts=st.lists(st.floats(0, 1), max_size=5),
)
def test_a_sketch_is_within_its_error_bound_and_does_not_depend_on_chunks(seed, n, order, cuts):
    """Bound: every rank is within `rank_error`, which is below 0.25 % at a million values and smaller for fewer."""
    values = ORDERS[order](np.random.default_rng(seed).normal(size=n))
    sketch, cut = QuantileSketch(), QuantileSketch()
    sketch.add(values)
    for part in np.split(values, sorted(int(each * n) for each in cuts)):
        cut.add(part)
    assert [each.tolist() for each in cut.levels] == [each.tolist() for each in sketch.levels]
    assert cut.halved == sketch.halved
    assert sketch.counts.sum() == n
    assert sketch.rank_error <= 0.0025 * n
    in_order, everything = np.argsort(sketch.values, kind="stable"), np.sort(values)
    kept = sketch.values[in_order]
    through = np.concatenate([[0], np.cumsum(sketch.counts[in_order])])
    ranks = through[np.searchsorted(kept, everything, side="right")]
    assert np.abs(ranks - np.searchsorted(everything, everything, side="right")).max() <= sketch.rank_error


def test_the_rank_error_of_a_million_values_is_below_a_quarter_of_a_percent_with_few_values_stored():
    sketch = QuantileSketch()
    sketch.add(RNG.normal(size=1_000_000))
    assert sketch.rank_error < 2500
    assert sketch.values.size < 10 * CAPACITY


def test_a_quantile_of_weighted_values_equals_that_of_repeated_values():
    values, counts = RNG.normal(size=50), RNG.integers(1, 9, 50)
    for share in (0.05, 0.5, 0.95):
        assert quantile_with_interval(values, share, counts) == quantile_with_interval(np.repeat(values, counts), share)


@pytest.fixture(scope="module")
def tally():
    tally = Tally.empty(2, 2)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("a7sim.study.tally.SAMPLE", 30)
        tally.add(0, RNG.normal(size=(2, 3 * CAPACITY)))
        tally.add(1, np.where(RNG.random((2, 40)) < 0.1, np.nan, RNG.normal(size=(2, 40))))
    return tally


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("other", KINDS)
def test_a_checkpoint_of_each_kind_is_complete_and_can_be_continued_as_the_other(tmp_path, tally, name, other):
    save(tally, tmp_path / name, "study")
    again = load(tmp_path / name, "study")
    save(again, tmp_path / other, "study")
    assert newest_checkpoint(tmp_path) == tmp_path / other
    assert [path.name for path in tmp_path.iterdir()] == [other]
    more = RNG.normal(size=(2, CAPACITY))
    written = []
    for each in (load(tmp_path / other, "study"), load(tmp_path / other, "study")):
        each.add(1, more)
        save(each, tmp_path / other, "study")
        written.append((tmp_path / other).read_bytes())
    save(tally, tmp_path / other, "study")
    straight = load(tmp_path / other, "study")
    straight.add(1, more)
    save(straight, tmp_path / other, "study")
    assert written == [(tmp_path / other).read_bytes()] * 2


@pytest.mark.parametrize("name", KINDS)
def test_an_empty_tally_can_be_saved_and_loaded(tmp_path, name):
    save(Tally.empty(2, 3), tmp_path / name, "study")
    again = load(tmp_path / name, "study")
    assert (again.done.tolist(), again.mean.shape, again.sample(1).shape) == ([0, 0], (2, 3), (3, 0))


@pytest.mark.parametrize("name", KINDS)
def test_the_error_message_for_a_wrong_checkpoint_is_one_sentence(tmp_path, tally, name, monkeypatch):
    path = tmp_path / name
    save(tally, path, "study")
    with pytest.raises(A7SimError, match=r"got that of another \(--force"):
        load(path, "another")
    monkeypatch.setattr("a7sim.__version__", "0.0.9")
    with pytest.raises(A7SimError, match=r"expected a checkpoint of a7sim 0\.0\.9, got one of"):
        load(path, "study")
    for damaged in (b"nothing", b"", path.read_bytes()[:-300]):
        path.write_bytes(damaged)
        with pytest.raises(A7SimError, match="got a file that is none") as raised:
            load(path, "study")
        assert len(str(raised.value).splitlines()) == 1


def test_without_pyarrow_checkpoints_are_npz_and_parquet_gives_an_error(tmp_path, tally, monkeypatch):
    assert checkpoint_path(tmp_path).name == "checkpoint.parquet"
    save(tally, tmp_path / "checkpoint.parquet", "study")
    monkeypatch.setattr(checkpoint, "find_spec", lambda name: None)
    assert checkpoint_path(tmp_path).name == "checkpoint.npz"
    with pytest.raises(A7SimError, match=r"pip install 'a7sim\[parquet\]'"):
        load(tmp_path / "checkpoint.parquet", "study")


def test_a_parquet_checkpoint_is_a_table_that_others_can_read(tmp_path, tally):
    """A row for every cell and response, with the sample as a list."""
    from pyarrow import parquet  # noqa: PLC0415

    save(tally, tmp_path / "checkpoint.parquet", "study")
    rows = parquet.read_table(tmp_path / "checkpoint.parquet").to_pylist()
    assert [(row["cell"], row["response"], row["replicates"]) for row in rows] == [
        (1, 1, 3 * CAPACITY),
        (1, 2, 3 * CAPACITY),
        (2, 1, 40),
        (2, 2, 40),
    ]
    assert rows[0]["sample"] == tally.sample(0)[0].tolist()
