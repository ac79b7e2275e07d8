"""The most recently used results of a function, each computed once, however many ask for it at a time."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Recent(Generic[Value]):
    """A function whose last `size` results are kept; what it raises is not.

    Unlike with `functools.lru_cache`, who asks for what another thread computes waits for that instead of
    computing it as well.
    """

    def __init__(self, size: int, function: Callable[..., Value]) -> None:
        self._size = size
        self._function = function
        self._results: OrderedDict[tuple[Hashable, ...], Future[Value]] = OrderedDict()
        self._lock = threading.Lock()

    def __call__(self, *arguments: Hashable) -> Value:
        """The function's result for these arguments."""
        with self._lock:
            result = self._results.get(arguments)
            is_new = result is None
            if result is None:
                result = self._results[arguments] = Future()
                while len(self._results) > self._size:
                    self._results.popitem(last=False)
            self._results.move_to_end(arguments)
        if is_new:
            self._compute(arguments, result)
        return result.result()

    def _compute(self, arguments: tuple[Hashable, ...], result: Future[Value]) -> None:
        try:
            result.set_result(self._function(*arguments))
        except BaseException as error:
            with self._lock:
                if self._results.get(arguments) is result:
                    del self._results[arguments]
            result.set_exception(error)
