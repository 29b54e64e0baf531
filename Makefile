# Everything a developer or CI does; `make help` lists it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUST := $(shell find rust -name '*.rs') Cargo.toml Cargo.lock
PYTHON_FILES := $(shell find python -name '*.py*' -not -path '*/__pycache__/*' -not -name '*.so')
# The extras that pyproject.toml collects in `all`; maturin would look for the package itself in an index.
EXTRAS := $(shell sed -n 's/^all = \["allanite\[\(.*\)\]"\]$$/\1/p' pyproject.toml)
# Toolchain of miri, sanitizers and fuzz targets; the workflows set a dated one.
NIGHTLY ?= nightly
export ALLANITE_DATA ?= $(abspath ../shared/data)

.PHONY: help demo screenshots coverage test test-all test-nightly test-rust test-python test-slow test-claims test-long floors lint bench bars miri sanitize clean gallery notebooks docs fuzz fuzz-core release
help: ## list the commands
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

# Each step writes a stamp file, so that nothing is built or installed twice.
$(VENV)/.made:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.14,<2'
	touch $@

$(VENV)/.installed: $(VENV)/.made $(RUST) $(PYTHON_FILES) pyproject.toml
	$(BIN)/maturin build --release --quiet --locked --interpreter $(BIN)/python --out target/wheels
	$(BIN)/python -m pip install --quiet --force-reinstall --no-deps "$$(ls -t target/wheels/*.whl | head -n 1)"
	$(BIN)/python -m pip install --quiet "$$(ls -t target/wheels/*.whl | head -n 1)[all]"
	touch $@

$(VENV)/.developed: $(VENV)/.made $(RUST) pyproject.toml
	$(BIN)/python -m pip install --quiet --group test --group lint
	$(BIN)/maturin develop --release --quiet --locked --extras $(EXTRAS)
	touch $@ $(VENV)/.installed

demo: $(VENV)/.installed ## build, install into .venv, and find two hidden effects in a simulated gyroscope
	$(BIN)/allanite demo --output demo

screenshots: $(VENV)/.developed ## take pictures of the page and the report in both themes (needs chromium)
	$(BIN)/python docs/screenshot_page.py --every
	$(BIN)/python docs/screenshot_report.py

test: test-rust test-python ## the quick tests (five minutes after the build)

test-all: test test-slow test-claims test-long ## also slow tests, statistical claims on few records, and long tests

test-nightly: coverage test-rust test-slow test-claims test-long ## also every statistical claim on all its records (hours)
	$(BIN)/python benches/claims/full_counts.py -n 2 -q

test-rust: ## the core's own tests, no interpreter needed (PROPTEST_RNG_SEED= looks for other examples)
	PROPTEST_RNG_SEED=$(or $(PROPTEST_RNG_SEED),0) cargo test --quiet --locked

test-python: $(VENV)/.developed ## the package's quick tests; warnings are errors
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m 'not slow and not long and not statistical'

coverage: $(VENV)/.developed ## the lines of the package that the quick tests run
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m 'not slow and not long and not statistical' --cov=allanite --cov-report=term:skip-covered

test-slow: $(VENV)/.developed ## tests of about a second or more: whole commands, the page in a browser
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m 'slow and not long and not statistical'

test-claims: $(VENV)/.developed ## statistical claims on few records, without the longest
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m 'statistical and not long'

test-long: $(VENV)/.developed ## tests above eight seconds: whole commands, the page in every view, fleets, the longest claims
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m long

floors: $(VENV)/.made ## the tests with the lowest versions that pyproject.toml allows, in target/floors
	$(PYTHON) -m venv target/floors
	target/floors/bin/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(PYTHON) tests/floors.py > target/floors/pins.txt
	target/floors/bin/python -m pip install --quiet -r target/floors/pins.txt --group test
	$(BIN)/maturin build --release --quiet --locked --interpreter target/floors/bin/python --out target/floors
	target/floors/bin/python -m pip install --quiet --force-reinstall --no-deps target/floors/*.whl
	target/floors/bin/python -m pytest -n 2 -q -m 'not statistical and not browser' -W default::DeprecationWarning -W default::pytest.PytestUnraisableExceptionWarning

lint: $(VENV)/.developed ## formatting, spelling, style, types, stubs, layers, clippy
	cargo fmt --check -- $(filter rust/%,$(RUST))  # also the files that a macro declares
	cargo clippy --quiet --locked --all-targets -- -D warnings
	cargo clippy --quiet --locked --features python -- -D warnings
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell *.md docs python rust tests benches examples
	$(BIN)/mypy
	$(BIN)/mypy --config-file benches/mypy.ini benches/*/*.py docs/*.py examples/*.py
	$(BIN)/python -m mypy.stubtest allanite._core --mypy-config-file pyproject.toml --allowlist stubtest-allowlist.txt
	$(BIN)/lint-imports
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	$(BIN)/zizmor --quiet --offline --no-progress .github

fuzz: $(VENV)/.developed ## ten minutes of damaged files, strings and requests, and logs with one field changed (SECONDS_EACH=, MUTANTS=, SEED=)
	$(BIN)/python tests/python/fuzz/run.py --seconds $(or $(SECONDS_EACH),25) --seed $(or $(SEED),0)
	$(BIN)/python tests/python/fuzz/structured.py --mutants $(or $(MUTANTS),20000) --seed $(or $(SEED),0)

fuzz-core: ## fuzz the text reader of the core with libFuzzer, one minute for each target (needs nightly and cargo-fuzz)
	for target in text dialect pipes; do \
	  mkdir -p target/fuzz/$$target; \
	  cargo +$(NIGHTLY) fuzz run $$target target/fuzz/$$target fuzz/corpus/$$target -- \
	    -max_total_time=$(or $(SECONDS_EACH),60) -rss_limit_mb=2000 -timeout=10 || exit 1; \
	done

release: $(VENV)/.made ## VERSION=1.2.3: check and build a release; nothing leaves this machine
	@$(BIN)/python docs/release.py "$(VERSION)"
	rm -rf target/source && mkdir -p target/source
	git archive HEAD | tar -x -C target/source
	$(BIN)/python target/source/docs/release.py --links
	$(BIN)/maturin build --manifest-path target/source/Cargo.toml --target-dir target --release --locked --sdist --out dist
	$(BIN)/python -m pip install --quiet twine
	$(BIN)/twine check --strict dist/*
	@echo "To publish $(VERSION): commit, git tag -a v$(VERSION), git push --tags; the release workflow does the rest."

bench: $(VENV)/.developed ## ratios against other programs, side by side, written to benches/record
	$(BIN)/python -m pip install --quiet --group bench
	cargo bench --quiet --locked
	$(BIN)/python benches/python/run.py

gallery: $(VENV)/.developed ## build models of real recordings (ALLANITE_DATA) and write docs/gallery
	$(BIN)/python docs/make_gallery.py

notebooks: $(VENV)/.developed ## run the notebooks of docs/ and store their outputs
	$(BIN)/python -m pip install --quiet --group docs
	$(BIN)/python docs/make_notebooks.py

docs: $(VENV)/.developed ## build the site in target/site from docs/ and the package; check all links
	$(BIN)/python -m pip install --quiet --group docs
	$(BIN)/python docs/site/make_site.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --config-file target/mkdocs.yml

bars: $(VENV)/.developed ## compare each promised ratio with its measurement (quiet machine, ten minutes)
	$(BIN)/python -m pip install --quiet --group bench
	$(BIN)/python benches/python/bars.py

miri: ## test loops with unsafe code for undefined behavior (needs nightly with miri)
	cargo +$(NIGHTLY) miri test --quiet --test unsafe_code
	RUSTFLAGS='-C target-feature=+avx2,+fma' cargo +$(NIGHTLY) miri test --quiet --test unsafe_code

sanitize: ## run tests of unsafe code, readers and kernels under AddressSanitizer (needs nightly)
	RUSTFLAGS=-Zsanitizer=address CARGO_TARGET_DIR=target/sanitize cargo +$(NIGHTLY) test --quiet --locked \
	  --target $$(rustc -vV | sed -n 's/host: //p') --test unsafe_code --test kernels --test text --test accumulator

clean: ## remove all built files
	rm -rf target $(VENV) demo dist
