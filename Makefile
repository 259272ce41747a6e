# make help     what there is
PYTHON ?= $(or $(shell command -v python3.11),python3)
RUN := PYTHONPATH=. .venv/bin/python
SAMPLE := sample_scenes/textured_grasp/frames
DEMO := build/demo
# bpy and pymeshlab do not share a process well, so tests that need bpy get one of their own, beside that of the others.
BPY_TESTS := tests/blender tests/headless
BPY_TESTS_LOG := build/tests_with_bpy.log
PYTEST := $(RUN) -m pytest -q --durations=10
LOCK := build/lock/bin/uv pip compile --quiet --upgrade --generate-hashes --no-annotate --no-emit-index-url \
	--custom-compile-command "make lock"

.PHONY: help environment demo test tests-without-bpy tests-with-bpy fuzz peers viewers web-viewer lint samples pictures pages extension test-extension lock clean

help:
	@sed -n 's/^## //p' Makefile

environment:
	@$(PYTHON) environment/create.py
	@$(PYTHON) web_viewer/build.py --optional

## make demo       run the whole job on a sample sequence, into build/demo
demo: environment
	$(RUN) headless/run.py $(SAMPLE) --output $(DEMO) --preset draft --preview $(DEMO)/preview.png

## make test       all tests
test: environment
	@$(MAKE) --no-print-directory --keep-going --jobs=2 tests-without-bpy tests-with-bpy

tests-without-bpy:
	@$(PYTEST) tests $(BPY_TESTS:%=--ignore=%)

tests-with-bpy:
	@mkdir -p build
	@$(PYTEST) $(BPY_TESTS) > $(BPY_TESTS_LOG) 2>&1; status=$$?; cat $(BPY_TESTS_LOG); exit $$status

## make fuzz       read 100,000 damaged files of all kinds in child processes with limits, and decode 20,000 damaged .refmesh files
fuzz: environment
	$(RUN) -m tests.fuzzing.fuzz 100000
	REFMESH_DAMAGED_STREAMS=5000 $(RUN) -m pytest -q tests/io/refmesh_stream/test_damage.py

## make peers      add libigl, Open3D and DracoPy to .venv, for benchmarks
peers: environment
	.venv/bin/pip install --quiet --require-hashes --no-deps -r environment/peers.txt

## make viewers    add the programs that tests open GLB files with, from npm, to build/node (REFMESH_NODE_MODULES= for another place)
viewers:
	npm install --silent --no-save --prefix build/node gltf-validator@2.0.0-dev.3.10 meshoptimizer@1.3.0 \
		babylonjs@9.35.0 babylonjs-loaders@9.28.0

## make web-viewer bundle the viewer of --export web with three.js from npm; `make environment` does so where npm is there
web-viewer:
	$(PYTHON) web_viewer/build.py

## make lint       style, docstrings, types, and who may import whom
lint: environment
	.venv/bin/ruff check .
	.venv/bin/mypy
	$(RUN) -m pytest -q tests/packaging/test_layers.py

## make samples    write the frames in sample_scenes/ again
samples: environment
	$(RUN) -m sample_scenes.grasp.generate
	$(RUN) -m sample_scenes.textured_grasp.generate

## make pictures   draw the pictures in docs/pictures again
pictures: demo
	$(RUN) docs/make_pictures.py

## make pages      write the pages of the panel in docs/panel as HTML again
pages: environment
	$(RUN) docs/make_panel_pages.py

## make extension  the zips to be installed in Blender, one for each platform, in build/ (WITH_PYMESHLAB=1 puts PyMeshLab in)
extension: environment
	$(RUN) extension/build.py

## make test-extension  build the zips twice, then install and run them in every Blender there is (BLENDER=, PYTHON313=, TRIALS=)
test-extension: extension
	$(RUN) extension/build.py --output build/again
	@for zip in build/again/*.zip; do cmp $$zip build/$${zip##*/} || exit 1; done; echo "built twice: the same bytes"
	$(RUN) extension/trial.py $(TRIALS)

## make lock       choose versions and hashes anew from the .in files
lock:
	$(PYTHON) -m venv --clear build/lock && build/lock/bin/pip install --quiet uv==0.13.9
	$(LOCK) --python-version 3.11 environment/requirements.in -o environment/requirements.txt
	$(LOCK) --python-version 3.11 -c environment/requirements.txt environment/peers.in -o environment/peers.txt
	$(LOCK) --python-version 3.11 --no-deps extension/wheels.in -o extension/wheels-cp311.txt
	$(LOCK) --python-version 3.13 --no-deps extension/wheels.in -o extension/wheels-cp313.txt
	$(LOCK) --python-version 3.11 --no-deps extension/pymeshlab.in -o extension/pymeshlab.txt

## make clean      remove .venv and everything that was built
clean:
	rm -rf .venv build wheels refmesh_addon/io/web_page/viewer.js
