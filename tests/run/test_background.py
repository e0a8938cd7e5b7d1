"""Reading ahead and writing behind: order, limits, errors, and ends."""

import gc
import itertools
import threading
import time

import pytest

from wgmb.threads import Behind, ahead

pytestmark = pytest.mark.fast


def threads():
    return {t for t in threading.enumerate() if t.name in ("ahead", "behind")}


@pytest.fixture
def left():
    """The threads that a test leaves, beside those that others left before it."""
    before = threads()
    return lambda: threads() - before


def test_items_come_in_order_and_few_are_made_beforehand():
    made = []

    def items():
        for n in range(20):
            made.append(n)
            yield n

    got = ahead(items(), 3)
    assert next(got) == 0
    time.sleep(0.1)
    assert len(made) <= 6
    assert list(got) == list(range(1, 20))


def test_an_error_comes_after_the_items_before_it():
    def items():
        yield 1
        raise ValueError("torn")

    got = ahead(items(), 2)
    assert next(got) == 1
    with pytest.raises(ValueError, match="torn"):
        next(got)


def test_nobody_reads_on_and_the_thread_ends(left):
    got = ahead(itertools.count(), 2)
    assert [next(got), next(got)] == [0, 1]
    got.close()
    time.sleep(0.2)
    assert not left()


def test_work_is_done_in_order_and_all_of_it(left):
    done = []
    with Behind(done.append) as put:
        for n in range(50):
            put(n)
    assert done == list(range(50)) and not left()


@pytest.mark.parametrize("when", [0, 30])
def test_an_error_of_the_work_is_raised_where_it_is_given(when, left):
    def work(n):
        if n == when:
            raise OSError("full")

    with pytest.raises(OSError, match="full"), Behind(work) as put:
        for n in range(31):
            put(n)
    assert not left()


def test_an_error_of_the_caller_leaves_the_rest_undone(left):
    done = []

    def slowly(n):
        time.sleep(0.02)
        done.append(n)

    with pytest.raises(KeyboardInterrupt), Behind(slowly) as put:
        put(1)
        raise KeyboardInterrupt
    assert len(done) <= 1 and not left()


def test_work_that_is_begun_is_done_before_the_caller_goes_on_after_an_error(left):
    """A caller closes the file that is written to, which an encoder may still be at."""
    begun, done = threading.Event(), []

    def work(n):
        begun.set()
        time.sleep(1.2)
        done.append(n)

    with pytest.raises(KeyboardInterrupt), Behind(work) as put:
        put(1)
        begun.wait()
        raise KeyboardInterrupt
    assert done == [1] and not left()


def test_what_its_own_thread_collects_ends_without_a_word():
    """In a cycle, a generator may be garbage that any thread finds, also the one it waits for."""
    given_up, ended = threading.Event(), threading.Event()

    def items():
        yield 1
        given_up.wait(10)
        gc.collect()
        ended.set()
        yield 2

    gc.disable()
    try:
        cycle = [ahead(items())]
        cycle.append(cycle)
        next(cycle[0])
        del cycle
        given_up.set()
        assert ended.wait(10)
    finally:
        gc.enable()
