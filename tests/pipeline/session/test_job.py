import json
from dataclasses import replace

import pytest

from refmesh_addon.core.errors import RefMeshError
from refmesh_addon.core.settings import Settings
from refmesh_addon.pipeline.session.job import STAGES, JobSpec


def test_a_job_survives_the_way_to_another_process():
    settings = Settings.from_flat({"centers": 64, "mapping": "rbf", "smoothness": 0.02})
    spec = JobSpec("/in/Füße *.obj", "/out", "6-10,14", settings, until="reference", resume=False, warnings=("before",), notes=("size",))
    spec = replace(spec, scheduler="tcp://host:8786")
    assert JobSpec.from_json(spec.to_json()) == spec
    assert JobSpec.from_json(JobSpec("a", "b").to_json()) == JobSpec("a", "b")


def test_until_names_the_last_stage():
    assert JobSpec("a", "b").stages == STAGES
    assert JobSpec("a", "b", until="reference").stages == ("tracking", "reference")
    with pytest.raises(RefMeshError, match="'polish' is not a stage: choose one of sequence, tracking"):
        JobSpec("a", "b", until="polish")


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "{}", '{"source": "a", "output": "b", "color": 1}', '{"source": "a", "output": "b", "settings": 3}']
)
def test_what_is_no_job_is_refused(text):
    with pytest.raises(RefMeshError, match="job file cannot be understood"):
        JobSpec.from_json(text)


def test_a_setting_out_of_range_is_refused_by_name():
    with pytest.raises(RefMeshError, match="--centers is 3"):
        JobSpec.from_json('{"source": "a", "output": "b", "settings": {"centers": 3}}')


@pytest.mark.parametrize(
    "changed",
    [
        {"source": 3},
        {"source": "a\0b"},
        {"output": None},
        {"frames": []},
        {"resume": "yes"},
        {"warnings": "text"},
        {"notes": [1]},
        {"settings": [1]},
        {"settings": {"mesh": "a\0b"}},
        {"settings": {"texture": []}},
        {"settings": {"least_overlap": float("nan")}},
        {"until": {}},
        {"scheduler": 8786},
    ],
)
def test_values_of_other_types_are_refused(changed):
    with pytest.raises(RefMeshError):
        JobSpec.from_json(json.dumps({"source": "a", "output": "b", **changed}))


def test_deeply_nested_jobs_are_refused():
    with pytest.raises(RefMeshError, match="job file"):
        JobSpec.from_json('{"source": ' + "[" * 100_000)
