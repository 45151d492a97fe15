"""What all tests share."""

from collections.abc import Iterator

import pytest

from creepkit.registry import default_registry
from helpers.compilers import compiler_or_skip, skipped_without_need


@pytest.fixture(scope="session")
def gfortran() -> str:
    """The Fortran compiler."""
    return compiler_or_skip("gfortran")


@pytest.fixture(scope="session")
def gcc() -> str:
    """The C compiler."""
    return compiler_or_skip("gcc")


@pytest.fixture(scope="session")
def gxx() -> str:
    """The C++ compiler."""
    return compiler_or_skip("g++")


@pytest.fixture(scope="module")
def one_torch_thread() -> Iterator[None]:
    """Two threads of torch on a busy core are many times slower than one."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(autouse=True)
def plugin_files_of_one_test_alone() -> Iterator[None]:
    """Plugin files that a test loads, and specimens that it gives, are gone with it: tests run in any order."""
    yield
    registry = default_registry()
    if registry._given or any(plugin.source.is_file for plugin in registry._loaded()):
        default_registry.cache_clear()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--no-needless-skips",
        action="store_true",
        help="fail when a test was skipped although the compiler or the data that it needs are there",
    )


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Runs where reports of all workers arrive; workers have no terminal."""
    terminal = session.config.pluginmanager.get_plugin("terminalreporter")
    if terminal is None or not session.config.getoption("--no-needless-skips"):
        return
    reasons = [report.longrepr[2] for report in terminal.stats.get("skipped", ())]
    needless = skipped_without_need(reasons)
    for reason in sorted(set(needless)):
        terminal.write_line(f"skipped {needless.count(reason)} times without need: {reason}", red=True)
    if needless:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
