# Everything works from a clean clone with nothing but Python 3.11 or newer: the first target that needs it makes .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.stamp
VSCODE := editors/vscode
EXTRAS ?= dev

TORCH ?= torch==2.13.0
WORKERS ?= auto
TESTS := $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 8 --dist worksteal --durations 20

.PHONY: tables docs wheels demo gallery test quick fuzz lint check format clean pictures test-bridges hours vsix e2e

demo: $(STAMP)  ## the paper's programs, evaluated and differentiated
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python examples/demo.py

gallery: $(STAMP)  ## docs/gallery: pictures of the examples with times and errors, held to other methods, in a few minutes
	$(BIN)/python examples/gallery
	$(BIN)/python tests/worlds/checked_gallery.py

test: $(STAMP)  ## every test
	$(TESTS)

quick: $(STAMP)  ## the tests that take no time
	$(TESTS) -m "not slow"

fuzz: $(STAMP)  ## every law, with examples that nobody has seen
	$(TESTS) --hypothesis-profile=explore tests/properties tests/primitives tests/arrays tests/calculus tests/core tests/integrate \
		tests/ide/test_every_offset.py tests/lsp/test_lsp_every_offset.py tests/lsp/test_lsp_fuzz.py tests/lsp/test_lsp_text.py tests/crew

test-bridges: $(STAMP)  ## JAX, PyTorch and scipy: installed into .venv (PyTorch for the CPU), their own gradient checks run
	$(BIN)/python -m pip install -qq --disable-pip-version-check 'jax>=0.4.36' optax
	$(BIN)/python -c 'import torch' 2>/dev/null || $(BIN)/python -m pip install -qq --disable-pip-version-check $(TORCH)
	$(BIN)/python -m pytest -rs tests/bridges tests/docs/test_readme.py tests/docs/test_hours.py

hours:  ## a stranger's first hours, docs/hour-*.md, in a fresh clone with JAX and PyTorch
	PYTHON=$(PYTHON) TORCH=$(TORCH) .ci/hours

lint: $(STAMP)  ## lints, types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/mypy

check: lint  ## lints, types, floors
	$(BIN)/python -m pytest tests/test_architecture.py

tables: $(STAMP)  ## potto/syntax/parse_tables.json: what the parser reads, of the grammar as it is now
	$(BIN)/python -c 'from potto.syntax.parse_tables import write; write()'

docs: $(STAMP)  ## the pages as a site in build/site: links and anchors checked, their programs run
	$(BIN)/python -c 'import material' 2>/dev/null || $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict
	$(BIN)/python -m pytest -n auto --maxprocesses 8 tests/docs

wheels:  ## dist/: a wheel, and one with machine code where a C compiler is, each tried in a bare environment
	PYTHON=$(PYTHON) .ci/wheels

vsix: $(VSCODE)/node_modules/.stamp  ## the extension for Visual Studio Code, checked, tested and packaged
	cd $(VSCODE) && npm run --silent check && npm run --silent test && npm run --silent package

e2e: $(STAMP)  ## the editors: the packaged extension in a real Visual Studio Code, and Neovim, Emacs, Vim (INSTALL=1 gets what is missing)
	INSTALL=$(INSTALL) sh editors/e2e.sh

pictures: $(STAMP)  ## the figures of the pages, light and dark
	$(BIN)/python docs/write_pictures.py

format: $(STAMP)  ## what ruff can put right by itself
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:  ## start over
	rm -rf $(VSCODE)/node_modules $(VSCODE)/e2e/node_modules $(VSCODE)/dist
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Potto needs Python 3.11 or newer; try make PYTHON=python3.11"; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[$(EXTRAS)]'
	$(BIN)/python -m compileall -q potto lsp/potto_lsp repl/potto_repl  # as pip does with all but what stays where it is
	touch $(STAMP)

$(VSCODE)/node_modules/.stamp: $(VSCODE)/package-lock.json
	@command -v npm >/dev/null || { echo "make vsix needs npm (Node.js 20 or newer)"; exit 1; }
	cd $(VSCODE) && npm ci --no-audit --no-fund --loglevel=error
	touch $@
