# Everything this repository knows how to do. `make` lists the ten targets that most people need, `make help-all` all.
# Set PYTHON to choose the interpreter that makes .venv, CC to choose the compiler.
PY = .venv/bin/python
export CC
# Of tests: one thread each, and what one process has compiled of Python the next one reads, whatever a shell says.
EACH = OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=

FIRST = run|play|smoke|test|precheck|lint|generate|check|docs|wheel
help:
	@sed -nE 's/^($(FIRST)):[^#]*## /\1|/p' Makefile | awk -F'|' '{ printf "make %-9s %s\n", $$1, $$2 }'
	@echo "make help-all  list every target"

help-all: ## list every target
	@sed -n 's/^\([a-z-]*\):[^#]*## /\1|/p' Makefile | awk -F'|' '{ printf "make %-31s %s\n", $$1, $$2 }'

run: compiler venv ## set up .venv, derive, compile, solve stances and hops, draw them
	$(PY) -m derive
	$(PY) tools/build_library.py
	.venv/bin/hopform stance --robot hopper_c --height 0.20 --u 3
	@mkdir -p out
	@echo "drawing into out/ ..."
	@set -e; for u in 0 3; do \
	    .venv/bin/hopform stance --height 0.20 --u $$u --plot out/stance_$${u}A.png >/dev/null; done
	.venv/bin/hopform hop --height 0.20 --terrain uniform --seed 1 --controller exact --h-des 0.20 --hops 12 \
	    --plot out/rough.png
	@printf '%s\n' "" "Open out/stance_3A.png and out/rough.png. Then try:" \
	    "  .venv/bin/hopform --help                              the commands; each has two examples in its help" \
	    "  .venv/bin/hopform robots hopper_c --toml > mine.toml  a robot's numbers, to edit; --robot mine.toml" \
	    "  make play                                             sliders and a hopper in the browser"

test: compiler venv-dev ## test the derivation, the generated code and the house rules
	$(PY) tools/build_library.py
	$(EACH) $(PY) -m pytest -n auto --dist loadfile --no-loadscope-reorder

durations: compiler venv-dev ## write tests/durations.json, the slow tests of `make test` by name
	$(PY) tools/build_library.py
	$(EACH) $(PY) -m pytest -q -n auto --dist loadfile --no-loadscope-reorder --write-durations

smoke: compiler venv-dev ## check an installation in a minute: digests, 1 000 stances
	$(PY) -m derive --check
	$(PY) tools/build_library.py
	$(PY) -m tests.repository.gate.digests
	$(PY) -m tests.conformance.exhaustive --seed $(SEED) --count 1000 --reference 1000

QUICK_TESTS = $(addprefix tests/repository/test_,words.py docs.py rooms.py derive.py facts.py statuses.py tests.py ci.py)
precheck: compiler venv-dev ## check style, stale files, words, links and rooms in 20 s
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	.venv/bin/lint-imports --no-cache --no-logo
	sh tools/lint_c.sh format
	$(PY) -m derive --check
	$(PY) tools/build_library.py
	$(EACH) $(PY) -m pytest -q -n auto -p no:cacheprovider -k "not builds" $(QUICK_TESTS)

format: venv-dev ## let the formatters write: ruff, clang-format
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .
	sh tools/lint_c.sh write

N = 1000000
test-exhaustive: compiler venv-dev ## certify N (1 000 000) random stances; then test-control-exhaustive
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.exhaustive --count $(N) --reference 2000 --cases out/cases.json
	$(PY) -m tests.conformance.currents --count $(TOUCHDOWNS) --step 1e-4

# The seed of every draw; nightly takes the day's.
SEED = 20261128
test-exhaustive-slice: compiler venv-dev ## the same for 20 000 of them by SEED, 500 with the 50-digit reference
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.exhaustive --seed $(SEED) --count 20000 --reference 500 --cases out/cases.json

nightly: ## the slower tests, the site and the long stages of .ci/run, all of them, longer and by the day's seed
	@set -e; seed=$$(date +%Y%m%d); export HOPFORM_SEED=$$seed FUZZ_SEED=$$seed; \
	    $(MAKE) venv-jax test-slices SLOW="sliced or nightly"; \
	    $(MAKE) site-test coverage-c test-determinism mutants-all test-exhaustive-slice fuzz SEED=$$seed

SLOW = sliced and not nightly
SLICES = tests/bench tests/conformance tests/oracle tests/unit tests/repository --ignore tests/repository/test_package.py
test-slices: compiler venv-dev ## the slower tests, or those in the files SLICES; the slowest run at night alone
	$(PY) tools/build_library.py
	$(EACH) $(PY) -m pytest -m "$(SLOW)" -n auto --dist loadfile --no-loadscope-reorder \
	    $(SLICES)

docs: compiler doxygen venv-docs ## build the site into out/site; warnings are errors
	$(PY) tools/build_library.py
	@rm -rf out/site out/doxygen out/doctrees && mkdir -p out
	$(PY) -m docs.gallery out/figures
	doxygen docs/site/Doxyfile
	$(PY) -m sphinx -W --keep-going -q -d out/doctrees -c docs/site . out/site
	$(PY) docs/play/build.py out/site/play ../README.html

figures: compiler venv ## draw the paper's figures 1 to 17 and the animation into out/figures, their captions beside them
	$(PY) tools/build_library.py
	$(PY) -m docs.gallery out/figures
	@echo "read out/figures/captions.md: every figure with its caption"

play: compiler venv-zig ## build the page to play with, one file in out/play
	@$(PY) tools/build_library.py
	@$(PY) docs/play/build.py out/play

site-test: venv-site docs ## follow every link of the site; open it in Chromium: numbers and digests are those of Python
	$(PY) -m pytest -q -m site tests

test-exhaustive-identification: compiler venv-dev ## fit 300 random robots, count how often intervals hold the truth
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.confidence --count 300
	$(PY) -m tests.conformance.robust --count 300
	$(PY) -m tests.conformance.nuisances --count 300

evidence-identification: compiler venv-dev ## fit random rigs of two generators, write docs/evidence/identification.md
	@$(PY) tools/build_library.py
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 nice $(PY) -m tests.conformance.evidence

reference-data: venv-dev ## solve the cases of the reference set with the oracle, write hopform/_reference/data
	$(PY) -m tests.conformance.reference_set

reference: compiler venv-dev ## score hopform, MuJoCo and smoothed friction, write docs/evidence/reference-set.md
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.reference_set.page

validate-data: compiler venv-dev ## fit the real recordings in HOPFORM_DATA, compare with what is published
	@$(PY) tools/build_library.py
	@$(PY) -m tests.conformance.published

scans: compiler venv-dev ## sweep across every case distinction of the solver, write docs/developers/switchovers.*
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.switchovers
TOUCHDOWNS = 10000
test-control-exhaustive: compiler venv-dev ## scan all currents at TOUCHDOWNS (10 000), against the controller
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.currents --count $(TOUCHDOWNS) --step 1e-4

SECONDS = 60
fuzz: ## arbitrary bits into each C entry point (or ENTRIES), SECONDS (60) each, under the sanitizers; needs clang
	@SECONDS_EACH=$(SECONDS) sh tests/fuzz/run.sh

EXAMPLES = 40
fuzz-outside: compiler venv-dev ## any objects, command lines and files from outside, EXAMPLES (40) times what test does
	$(PY) tools/build_library.py
	HOPFORM_EXAMPLES=$(EXAMPLES) $(PY) -m pytest -q -n auto -m "not site" tests/unit/test_outside_*.py

coverage-c: compiler venv-dev ## count the branches of the C that tests take; 95 % must be
	$(PY) tools/build_library.py
	$(PY) -m tests.repository.branch_coverage

MUTANTS = 400
TO_KILL = $(if $(LEAST),--least $(LEAST))
mutants-c: compiler venv-dev ## change MUTANTS (400) lines of the engine's C at random, see tests in C fail; needs gcc
	$(PY) -m tests.mutation --count $(MUTANTS) --seed $(SEED) $(TO_KILL)

frama-c: venv-dev ## Frama-C's Eva on the library for firmware, any bits as inputs; needs frama-c-base of Debian 12
	$(PY) -m tests.conformance.firmware.eva

test-exhaustive-kernels: compiler venv-dev ## every float32 input of every kernel in C against double precision
	nice $(PY) -m tests.conformance.kernels

firmware-test: compiler venv-dev ## the C library on emulated processors: selftest, golden vectors, garbage, costs
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.firmware

firmware-test-all: compiler venv-dev ## the same for every processor, compiler, optimisation and precision
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.firmware --all

firmware-report: compiler venv-dev ## count instructions, flash and stack there, write docs/evidence/firmware-costs.*
	$(PY) tools/build_library.py
	$(PY) -m tests.conformance.firmware --report

generate: venv ## derive the formulas into generated/, compile the library
	$(PY) -m derive
	@set -- runtime/hopform/_libhopform.*; [ ! -e "$$1" ] || $(PY) tools/build_library.py

check: venv ## fail if generated/ is stale, and show what differs
	$(PY) -m derive --check

test-manifests: compiler venv ## exported packages before their own readers, and the schemas in HOPFORM_SCHEMAS
	@test -d .venv-manifests || .venv/bin/python -m venv .venv-manifests
	@.venv-manifests/bin/pip install -q platformio idf-component-manager kconfiglib jsonschema pyyaml pykwalify xmlschema
	@rm -rf out/manifests
	@for each in platformio arduino esp-idf zephyr cmsis-pack; do \
	    .venv/bin/hopform export out/manifests/$$each --for $$each >/dev/null || exit 1; done
	.venv-manifests/bin/python -m tests.repository.manifests out/manifests

# Transitive versions are today's, but for pyparsing: its deprecations, errors in tests, are newer than matplotlib 3.9.
LOWEST_TESTS = $(addprefix tests/unit/test_,cli.py plots.py show.py estimation.py batch.py derivation.py)
test-lowest: compiler venv ## some tests with the oldest versions of what pyproject.toml requires, in .venv-lowest
	$(PY) tools/build_library.py
	@test -d .venv-lowest || .venv/bin/python -m venv .venv-lowest
	@.venv-lowest/bin/pip install -q uv
	@HOPFORM_COMPILE_LATER=1 VIRTUAL_ENV=$(CURDIR)/.venv-lowest .venv-lowest/bin/uv pip install -q \
	    --resolution lowest-direct --editable '.[all,derive]' 'pyparsing==3.2.*'
	@VIRTUAL_ENV=$(CURDIR)/.venv-lowest .venv-lowest/bin/uv pip install -q \
	    pytest pytest-xdist hypothesis jsonschema dask distributed
	.venv-lowest/bin/python -m pytest -q -n auto --dist loadfile tests/conformance/test_stance.py $(LOWEST_TESTS)

BASE = HEAD
gate: compiler venv-dev ## instructions, answers and public names of BASE and this checkout: nothing may have moved
	$(PY) -m tests.repository.gate $(BASE)

lint: venv-dev ## check style and types, of Python and of C
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	.venv/bin/lint-imports --no-cache --no-logo
	$(PY) -m mypy
	$(PY) -m pyright
	sh tools/lint_c.sh

wheel: compiler venv-dev ## build the sdist and the wheel, use it without a compiler
	@rm -rf dist
	$(PY) -m build --no-isolation
	.venv/bin/check-wheel-contents dist
	$(PY) tools/build_library.py
	$(PY) -m pytest -q -m sliced tests/repository/test_package.py

wheels: compiler venv-wheels ## the sdist and a wheel for each of PLATFORMS (all), cross compiled, into dist
	$(PY) tools/build_library.py
	@rm -rf dist
	$(PY) tools/wheels.py dist $(PLATFORMS)
	.venv/bin/check-wheel-contents dist
	.venv/bin/twine check --strict dist/*
	.venv/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff

COUNT = 60
mutants: compiler venv-dev ## change COUNT (60) places of the package at random, see tests fail
	$(PY) -m tests.mutation.python --count $(COUNT) --seed $(SEED) $(TO_KILL)

mutants-all: compiler venv-dev ## 400 places of the package, and mutants-c
	$(PY) -m tests.mutation.python --count 400 --seed $(SEED)
	$(PY) -m tests.mutation --count $(MUTANTS) --seed $(SEED)

test-determinism: venv-dev ## derive with every Python (or PYTHONS=--this-python), sympy, hash seed: the same bytes
	$(PY) -m tests.repository.determinism $(PYTHONS)

bench: compiler venv-bench ## time hopform and other solvers, write docs/evidence/benchmark.*; QUICK=1 is short
	$(PY) tools/build_library.py
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(PY) -m tests.bench $(if $(QUICK),--quick)
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(PY) -m tests.bench.identification

clean: ## remove everything that these targets made, except generated/
	rm -rf .venv .venv-manifests .venv-lowest out dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	rm -rf runtime/hopform/_libhopform*
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

compiler:
	@command -v $(firstword $(CC)) >/dev/null || \
	{ echo "hopform: no C compiler: $(firstword $(CC)) not found (set CC, or on Debian: apt install gcc)" >&2; exit 1; }

doxygen:
	@command -v doxygen >/dev/null || { echo "hopform: doxygen not found (on Debian: apt install doxygen)" >&2; exit 1; }

venv:
	@sh tools/venv.sh run

venv-dev:
	@sh tools/venv.sh dev

venv-bench:
	@sh tools/venv.sh bench

venv-jax:
	@sh tools/venv.sh jax

venv-wheels:
	@sh tools/venv.sh wheels

venv-zig:
	@sh tools/venv.sh zig

venv-docs:
	@sh tools/venv.sh docs

venv-site:
	@sh tools/venv.sh site

.NOTPARALLEL:
.PHONY: help help-all run test test-slices test-exhaustive test-exhaustive-slice test-exhaustive-identification
.PHONY: validate-data evidence-identification reference-data reference
.PHONY: test-lowest test-manifests
.PHONY: scans fuzz fuzz-outside generate check precheck format lint nightly wheel mutants mutants-all test-determinism bench gate
.PHONY: test-control-exhaustive
.PHONY: firmware-test firmware-test-all firmware-report coverage-c mutants-c frama-c test-exhaustive-kernels
.PHONY: clean compiler venv venv-dev venv-bench venv-docs venv-jax venv-site venv-wheels doxygen docs figures play site-test wheels
