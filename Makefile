# Every target sets up what it needs; nothing but Python >= 3.11 and make has to be there first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
DEV := $(VENV)/.dev
EXTRAS := $(VENV)/.extras
PEERS := .venv-peers

MINUTES ?= 60

.PHONY: install demo test test-all test-extras export-test docs mutate fuzz check bench benchmark generate clean

install: $(STAMP)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or later is needed; say which with make PYTHON=python3.12"; exit 1; }
	test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[plots]'
	$(BIN)/python -m compileall -q derive wheelpend  # also where Python may not write bytecode by itself
	touch $(STAMP)

# Tools of development, with the versions that the committed code is generated with.
$(DEV): $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $(DEV)

$(EXTRAS): $(DEV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[benchmark,export,bags,docs,notebook,view,browser,http,s3,servers]'
	touch $(EXTRAS)

demo: install
	$(BIN)/wheelpend demo --out demo

# What is quick: within eight minutes on two cores, with every kernel compiled anew.
test: $(DEV)
	$(BIN)/python -m pytest -m "not slow"

# Everything, also what takes long and what needs an extra: within 45 minutes.
test-all: $(EXTRAS)
	$(BIN)/python -m pytest

# What needs MuJoCo, FMPy, rosbags, pandas, python-control, NiceGUI or a browser, quick or not, but for what takes minutes.
test-extras: $(EXTRAS)
	$(BIN)/python -m pytest -m "extras and not long"

# The exports, with what compilers, emulators and Node.js are here; what is absent is listed.
export-test: $(EXTRAS)
	$(BIN)/python -m pytest tests/export -rs

# Small mistakes, one at a time, each of which the tests of its code must notice, the quick ones or else the slow: goes on
# where it was interrupted.
mutate: $(DEV)
	$(BIN)/python tests/mutation/run.py

# Hostile logs, models, laws and command lines, for an hour or MINUTES; goes on where it was, findings are in .fuzz/.
fuzz: $(DEV)
	$(BIN)/python tests/fuzz/run.py --minutes $(MINUTES)

# The site, in build/docs; a warning or a link that leads nowhere fails.
docs: $(EXTRAS)
	$(BIN)/sphinx-build -q -W --keep-going -c docs -d build/doctrees . build/docs
	@echo "The site is build/docs/docs/index.html"

check: $(DEV)
	$(BIN)/wheelpend generate --check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check derive wheelpend tests
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache  # which room may import which

# Speed beside peers, which get an environment of their own; one that cannot be installed is absent from the table.
bench: $(DEV)
	test -d $(PEERS) || $(PYTHON) -m venv $(PEERS)
	@for peer in casadi mujoco pysindy padasip scipy; do \
		$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check $$peer \
			|| echo "$$peer could not be installed; its rows will be absent"; \
	done
	$(BIN)/python -m wheelpend.benchmarks.speed --peers $(PEERS) $(if $(OUT),--out $(OUT))

# Hidden effects: a stratified sample of half an hour, or with FULL=1 all of it; goes on where it was interrupted.
benchmark: $(EXTRAS)
	$(BIN)/python -m wheelpend.benchmarks.hidden_effects $(if $(FULL),--out docs/benchmark.md,--minutes 28)

generate: $(DEV)
	$(BIN)/wheelpend generate
	$(BIN)/python -m derive.effects_page  # the sections of docs/effects.md

clean:
	rm -rf $(VENV) $(PEERS) demo build dist
