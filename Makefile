# make test   set up .venv, then check style, types, layers and run the tests, those of plugins/ included
# make nightly   what takes longer: slow tests, release, sanitizer, pictures, CalculiX, hostile input (.ci/nightly)
# make verify-export   exported laws in a CalculiX built from Debian's source, beside our solver: a table
# make docs   build the documentation into build/docs; needs no network once .venv is set up
# make core   compile the core (src/core) again where its sources changed; 'make test' does it first
# make sanitize   tests of the core with checks of addresses and of undefined behaviour; needs g++ and its libasan
# make demo   set up .venv, then identify laws from measured creep curves and a simulated bulge test; plots in demo/
#
# Both need make, Python and a network for pip; tests that need a compiler are skipped without it. The core is compiled by
# the machine's C++ compiler, else by that in the package ziglang (400 MB in .venv), which compiles it for pages of
# sliders in any case. PYTEST_OPTIONS goes to pytest.
# TORCH chooses another build of torch: make test TORCH='torch==2.13.0' on a machine with a GPU.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := test
.PHONY: test nightly core sanitize demo docs verify-export clean

PYTHONS := python3.11 python3.12 python3.13
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))

TORCH_CPU := torch==2.13.0+cpu
TORCH_ANY := torch==2.13.0
CPU_WHEELS := https://download.pytorch.org/whl/cpu

# Two threads of torch on one busy core are far slower than one; pytest runs two workers instead.
export OMP_NUM_THREADS := 1

# Seconds after which a test fails, and shows where it waits.
export PYTEST_TIMEOUT := 300

# What 'make sanitize' runs: the tests of packages that call the core, and of finite elements against closed forms.
SANITIZED_TESTS := tests/unit/core tests/unit/fem tests/unit/specimens $(wildcard tests/verification/test_fem_*.py)

test: core
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports --no-logo
	@mkdir -p build; $(BIN)/mypy >build/types 2>&1 & types=$$!; \
	$(BIN)/pytest -q -n 2 --dist loadfile $(PYTEST_OPTIONS); \
	wait $$types || { cat build/types; exit 1; }; cat build/types

nightly:
	bash .ci/nightly

core: .venv/.ok
	@$(BIN)/python src/core/compile.py >/dev/null

# The libraries of the sanitizer, and the C++ one whose exceptions it watches, come first into the process.
# An allocation beyond the memory returns nothing, as it does without the sanitizer.
sanitize: core
	$(BIN)/python src/core/compile.py --sanitize
	@CREEPKIT_CORE=$(CURDIR)/build/sanitize/libcreepkit_core.so ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 \
	    LD_PRELOAD="$$($(CXX) -print-file-name=libasan.so) $$($(CXX) -print-file-name=libstdc++.so)" \
	    $(BIN)/python -m pytest -q -n 2 -m "not long_when_sanitized and not nightly" $(PYTEST_OPTIONS) $(SANITIZED_TESTS)

demo: core
	$(BIN)/creepkit demo --to demo

docs: core
	@$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet --jobs 2 docs build/docs
	@echo "the documentation: build/docs/index.html"

verify-export: core
	$(BIN)/python -u tests/benchmarks/verify_export.py

.venv/.ok: pyproject.toml $(PLUGINS:%=%/pyproject.toml)
	@echo "set-up 1/4: virtual environment .venv"
	@for python in $(PYTHONS); do \
	    if $$python -c 'import ensurepip, venv' >/dev/null 2>&1; then $$python -m venv .venv; exit 0; fi; \
	done; echo "none of $(PYTHONS) can make a virtual environment; install one of them, with its venv module" >&2; exit 1
	@echo "set-up 2/4: torch"
ifdef TORCH
	@$(PIP) $(TORCH)
else
	@$(PIP) '$(TORCH_CPU)' 2>/dev/null \
	    || $(PIP) --retries 1 --timeout 20 --extra-index-url $(CPU_WHEELS) '$(TORCH_CPU)' 2>/dev/null \
	    || $(PIP) '$(TORCH_ANY)'
endif
	@echo "set-up 3/4: creepkit and what it needs"
	@tools=$$($(BIN)/python src/core/compile.py --requirements); \
	    $(PIP) 'hatchling>=1.26' 'editables>=0.5' $$tools || { echo "the core of creepkit cannot be compiled: this" \
	    "machine lacks" $$tools "and pip cannot get it; install a C++ compiler and CMake, or make PyPI reachable" >&2; \
	    exit 1; }
	@$(PIP) --no-build-isolation --no-deps --editable .
	@$(PIP) 'creepkit[dev]'
	@echo "set-up 4/4: plugins"
	@for plugin in $(PLUGINS); do $(PIP) --no-build-isolation --editable $$plugin; done
	@touch $@

clean:
	rm -rf .venv demo
