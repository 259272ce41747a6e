"""A job as an Open Job Description template (schema 2023-09), for render farms that read it, such as AWS Deadline Cloud.

The folder is a job bundle: `template.json`; the job with its settings, `job.json`; and the values of the template's parameters twice, as
Deadline Cloud reads them and as the `openjd` program does.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...io.files import atomic_file, output_folder, write_json
from ..session.job import JobSpec
from ..stages.steps import JobStep, job_steps
from .environment import PACKAGE_ROOT, package_folders, python_executable
from .single_thread import SINGLE_THREAD

VERSION = "jobtemplate-2023-09"
TEMPLATE, JOB = "template.json", "job.json"
VALUES, BUNDLE_VALUES = "parameters.json", "parameter_values.json"
MOST_TASKS = 32  # of a step, where the number is not changed: each takes seconds to start and reads what others have left
MODULE = "refmesh_addon.pipeline.process.part_worker"
LONGEST_NAME = 128  # characters of a job's name
# Name of each parameter -> its type and what it is for.
PARAMETERS = {
    "Input": ({"type": "PATH", "dataFlow": "IN"}, "The captured sequence"),
    "Output": ({"type": "PATH", "objectType": "DIRECTORY", "dataFlow": "OUT"}, "Folder for the results, shared by all machines"),
    "Job": ({"type": "PATH", "objectType": "FILE", "dataFlow": "IN"}, "The settings of the job"),
    "Python": ({"type": "STRING"}, "Python with the packages that RefMesh needs"),
    "PythonPath": ({"type": "STRING"}, "Folders of RefMesh and of these packages"),
    "Tasks": ({"type": "INT", "minValue": 1}, "Tasks of each step that works on single frames"),
}


@dataclass(frozen=True)
class SceneCommand:
    """A command that writes the scene and exports, with Blender. Input and output stand between its start and its options."""

    start: Sequence[str]
    options: Sequence[str]

    @property
    def line(self) -> list[str]:
        """With input and output as parameters of the template."""
        return [*map(_plain, self.start), "{{Param.Input}}", "--output", "{{Param.Output}}", *map(_plain, self.options)]


def write_open_job(folder: str | Path, spec: JobSpec, name: str, frames: int, scene: SceneCommand | None = None) -> list[Path]:
    """Writes the bundle and returns its files.

    name : of the job.  frames : how many it has.  scene : what a last step does; None leaves it out.
    Raises RefMeshError when the folder cannot be written to.
    """
    folder = output_folder(folder)
    steps = job_steps(spec, frames)
    values = {
        "Input": spec.source,
        "Output": spec.output,
        "Job": str((folder / JOB).absolute()),
        "Python": python_executable(),
        "PythonPath": os.pathsep.join([str(PACKAGE_ROOT), *package_folders()]),
        "Tasks": min(frames, MOST_TASKS),
    }
    bundle = {"parameterValues": [{"name": key, "value": value} for key, value in values.items()]}
    with atomic_file(folder / JOB) as file:
        file.write(spec.to_json().encode("utf-8"))
    for file_name, content in ((TEMPLATE, _template(name, frames, steps, scene)), (VALUES, values), (BUNDLE_VALUES, bundle)):
        write_json(folder / file_name, content)
    return [folder / one for one in (TEMPLATE, JOB, VALUES, BUNDLE_VALUES)]


def _template(name: str, frames: int, steps: Sequence[JobStep], scene: SceneCommand | None) -> dict:
    described = [_step(step, frames) for step in steps]
    if scene:
        described.append({"name": "Write Scene", "script": _script(scene.line)})
    for before, step in zip(described, described[1:]):
        step["dependencies"] = [{"dependsOn": before["name"]}]
    variables = {**SINGLE_THREAD, "PYTHONPATH": "{{Param.PythonPath}}", "PYTHONUTF8": "1", "PYTHONNOUSERSITE": "1"}
    return {
        "specificationVersion": VERSION,
        "name": _plain(f"RefMesh {name}")[:LONGEST_NAME],
        "parameterDefinitions": [{"name": key, **kind, "description": text} for key, (kind, text) in PARAMETERS.items()],
        "jobEnvironments": [{"name": "Packages", "variables": variables}],
        "steps": described,
    }


def _step(step: JobStep, frames: int) -> dict:
    command = ["{{Param.Python}}", "-m", MODULE, "{{Param.Job}}", "{{Param.Input}}", "{{Param.Output}}", step.name]
    if step.share is None or step.units == 1:
        return {"name": step.title, "script": _script(command)}
    count = "{{Param.Tasks}}" if step.units == frames else str(min(step.units, MOST_TASKS))
    space = {"taskParameterDefinitions": [{"name": "Part", "type": "INT", "range": f"1-{count}"}]}
    return {"name": step.title, "parameterSpace": space, "script": _script([*command, "{{Task.Param.Part}}", count])}


def _script(command: Sequence[str]) -> dict:
    return {"actions": {"onRun": {"command": command[0], "args": list(command[1:])}}}


def _plain(text: str) -> str:
    """Text that holds no format string of the template."""
    return text.replace("{{", "{ {").replace("}}", "} }")
