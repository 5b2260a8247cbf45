# Two commands matter: make run, make test. Both set up what they need on a machine with Python 3.11 and Node 20.
PYTHON ?= python3
BIN := .venv/bin
# Vite needs npm 11; Node 20 may come with npm 10
NPM := $(if $(shell npm --version 2>/dev/null | grep -E '^([1-9]|10)[.]'),npx --yes npm@11,npm)
WEB_SOURCES := $(shell git ls-files web 2>/dev/null || find web -type f -not -path '*/node_modules/*')
PORT ?= 8000
# what does not need each other, told apart where make can
SIDE_BY_SIDE := --no-print-directory --jobs=2 $(if $(filter output-sync,$(.FEATURES)),--output-sync=target)

.PHONY: help setup run test check check-service check-web fuzz audit bench bench-registration bench-browser bench-fleet bench-segmentation bench-updates fit-cuts load load-cost load-large chaos rehearse soak client browser

help:  ## what can be made
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 20

setup:  ## .venv with the service, and the web app built into it
	@$(MAKE) $(SIDE_BY_SIDE) .venv/installed web/node_modules/.package-lock.json
	@$(MAKE) --no-print-directory server/stillroom/static/index.html

run: setup  ## the service with demo homes whose robots upload missions, on http://127.0.0.1:$(PORT)
	$(BIN)/stillroom demo --port $(PORT)

check: setup  ## format, lint, types, import contracts, web checks: everything but the tests
	@$(MAKE) $(SIDE_BY_SIDE) check-service check-web

check-service:
	$(BIN)/ruff check server tests migrations
	$(BIN)/ruff format --check server tests migrations
	$(BIN)/mypy
	$(BIN)/lint-imports

check-web:
	cd web && $(NPM) run --silent check
	cd web && $(NPM) run --silent check:client

test: check browser  ## everything that must hold
	$(BIN)/pytest --numprocesses 3 --dist loadgroup

fuzz: setup  ## ask the whole API, and feed every reader and archives, with what nobody sends by mistake, for 10 minutes each; then all laws by examples that were not tried before
	STILLROOM_FUZZ_S=600 $(BIN)/pytest tests/fuzz
	STILLROOM_FUZZ_S=1 $(BIN)/pytest -m hypothesis

audit: setup  ## known holes of dependencies; asks the registries' advisory services, and fails where they do not answer
	@$(BIN)/python -m venv .venv/audit && .venv/audit/bin/pip install --quiet pip-audit
	.venv/audit/bin/pip-audit --strict --requirement constraints.txt --no-deps --disable-pip || { echo "audit: there are known holes, or the advisory service did not answer (see above)" >&2; exit 1; }
	cd web && $(NPM) audit --audit-level=low || { echo "audit: there are known holes, or the registry has no advisory service (see above)" >&2; exit 1; }

bench: setup  ## times of the pipeline's stages, of an upload over HTTP, and uploads a second
	$(BIN)/stillroom bench

bench-browser: setup browser  ## the first paint of a home, and frames while a divider is drawn
	$(BIN)/python -m tests.e2e.bench_browser

bench-segmentation: setup  ## rooms found on the real maps of ../shared/data: how right, and how fast
	$(BIN)/python -m tests.real.bench_segmentation

fit-cuts: setup  ## weights of what parts rooms, from the real maps of ../shared/data and simulated homes
	$(BIN)/python -m tests.real.fit_cuts

bench-registration: setup  ## real maps (../shared/data) without tracking: which are found, parked or put wrongly
	$(BIN)/python -m tests.real.bench_registration

bench-updates: setup  ## rates of errors over 8,500 simulated missions, pictures of each error (RESUME=--resume goes on)
	$(BIN)/stillroom benchmark --severity middle --robots 25 --missions 17 --seeds 20 $(RESUME) \
	  --out bench-updates/missions.jsonl --pictures bench-updates/pictures

bench-fleet: setup  ## a dashboard's questions about 1,000,000 missions of 10,000 robots, on both engines (some minutes)
	$(BIN)/python -m tests.service.fleet.bench_fleet

load: setup  ## missions a second, and what one costs, on PostgreSQL and an S3 store (LOAD="--rates 30 15 --seconds 60 …")
	$(BIN)/python -m tests.load.load $(LOAD)

load-cost: setup  ## CPU of a mission by part, and bytes that it leaves behind
	$(BIN)/python -m tests.load.cost

load-large: setup  ## an upload beside 1,000,000 missions of 10,000 robots is as fast as beside none
	$(BIN)/python -m tests.load.large

chaos: setup  ## kills of every part under load, a disk that fills up; then stillroom verify (5 minutes; CHAOS="--seconds 60 …")
	$(BIN)/python -m tests.load.chaos $(CHAOS)

rehearse: setup  ## a backup taken under load is restored beside the service, and verified
	$(BIN)/python -m tests.load.rehearse

soak: setup  ## an even load for an hour: memory and latency stay flat (SOAK="--seconds 600 …")
	$(BIN)/python -m tests.load.soak $(SOAK)

client: setup  ## the web app's API client, generated from the service's OpenAPI document
	cd web && $(NPM) run --silent client

browser:  ## Debian's Chromium, where it is missing: the browser tests need it
	@command -v chromium >/dev/null || { \
	  if [ "$$(id -u)" = 0 ]; then sudo=; else sudo=sudo; fi; \
	  $$sudo apt-get update -qq && $$sudo apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core; }

.venv/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev,postgresql]'
	@touch $@

web/node_modules/.package-lock.json: web/package.json web/package-lock.json
	cd web && $(NPM) ci --silent
	@touch $@

server/stillroom/static/index.html: web/node_modules/.package-lock.json $(WEB_SOURCES)
	cd web && $(NPM) run --silent build
	@touch $@
