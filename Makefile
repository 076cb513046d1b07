# Every target sets up what it needs; nothing but Python >= 3.11 and make has to be there first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: install demo test check benchmark generate clean

install: $(STAMP)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or later is needed; say which with make PYTHON=python3.12"; exit 1; }
	test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $(STAMP)

demo: install
	$(BIN)/wheelpend demo --out demo

test: install
	$(BIN)/python -m pytest

check: install
	$(BIN)/wheelpend generate --check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check derive wheelpend tests
	$(BIN)/mypy

# Hidden effects: a stratified sample of half an hour, or with FULL=1 all of it; goes on where it was interrupted.
benchmark: install
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[benchmark]'
	$(BIN)/python -m wheelpend.benchmark $(if $(FULL),--out docs/benchmark.md,--minutes 28)

generate: install
	$(BIN)/wheelpend generate

clean:
	rm -rf $(VENV) demo build dist
