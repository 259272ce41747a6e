"""Programs from npm that tests open files with; `make viewers` installs them."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

MODULES = Path(os.environ.get("REFMESH_NODE_MODULES", Path(__file__).resolve().parents[3] / "build" / "node" / "node_modules"))
VALIDATE = """
const fs = require('fs'), validator = require('gltf-validator');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(report => console.log(JSON.stringify(report.issues)));
"""


def node_package(name):
    """Folder of an npm package; the test is skipped where it is not installed."""
    if not (MODULES / name).is_dir():
        pytest.skip(f"the npm package '{name}' is not in {MODULES}: make viewers")
    return MODULES / name


def node(code, path, package):
    """What Node.js prints that runs a program with a package; the test is skipped where either is missing."""
    node_package(package)
    if not shutil.which("node"):
        pytest.skip("Node.js is not installed")
    environment = {**os.environ, "NODE_PATH": str(MODULES)}
    return subprocess.run(["node", "-e", code, str(path)], capture_output=True, text=True, check=True, env=environment).stdout
