"""The Helm chart: what Helm makes of it, what Kubernetes says of that, and what it promises.

Helm and the schemas of Kubernetes have an environment of their own: `make chart`.
"""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from service.cli import command_line
from tests.unit.test_deployment import SETTINGS
from worker.settings import WorkerSettings

ROOT = Path(__file__).parents[2]
PLACE = ROOT / "deploy" / "helm" / "meshcone"
TOOLS = Path(sys.prefix) / "chart"
BUCKET = {"secret": "broker", "files": {"url": "s3://assets/meshcone"}}
ALL = {
    "secret": "broker",
    "outboundSecret": "outbound",
    "files": {"existingClaim": "assets"},
    "settings": {"MESHCONE_RESULT_TTL": "86400", "AWS_REGION": "eu-central-1"},
    "image": {"pullSecrets": [{"name": "registry"}]},
    "autoscaling": {"enabled": True, "keySecret": "keda"},
    "ingress": {"enabled": True, "className": "nginx", "host": "m.example.org", "tlsSecret": "tls"},
    "networkPolicy": {
        "apiFrom": [{"namespaceSelector": {"matchLabels": {"name": "ingress"}}}],
        "brokerTo": [{"ipBlock": {"cidr": "10.20.0.7/32"}}],
    },
    "worker": {"tolerations": [{"key": "meshes", "operator": "Exists"}], "affinity": {}},
    "api": {"nodeSelector": {"disk": "fast"}, "podAnnotations": {"team": "assets"}},
}
REFUSED = [
    ({"files": {"url": "s3://a"}}, "secret: name a Secret"),
    ({"secret": "broker"}, "files: give one of"),
    ({"secret": "broker", "files": {"url": "s3://a", "existingClaim": "b"}}, "files: give one of"),
    ({**BUCKET, "wokers": 3}, "'wokers' not allowed"),
    ({**BUCKET, "settings": {"MESHCONE_WEBHOOK_SECRET": "whsec_x"}}, "MESHCONE_WEBHOOK_SECRET"),
    ({**BUCKET, "autoscaling": {"enabled": True}}, "autoscaling.keySecret: name a Secret"),
    ({**BUCKET, "autoscaling": {"minReplicas": 0}}, "minReplicas"),
    ({**BUCKET, "ingress": {"enabled": True}}, "ingress.host: name the host"),
]
PARTS = ("api", "worker", "webhooks", "transfers")

Manifest = dict[str, Any]


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    """What Helm and the schemas say of the chart, for BUCKET, ALL and what is refused."""
    if not (TOOLS / ".installed").is_file():
        pytest.skip("Helm's SDK is not installed: make chart")
    many = [BUCKET, ALL, *(values for values, _ in REFUSED)]
    done = subprocess.run(
        [TOOLS / "bin" / "python", Path(__file__).with_name("chart_tool.py"), PLACE],
        input=json.dumps(many),
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(params=["bucket", "all"])
def manifests(found: dict[str, Any], request: pytest.FixtureRequest) -> list[Manifest]:
    return found["rendered"][("bucket", "all").index(request.param)]["manifests"]


@pytest.fixture
def bucket(found: dict[str, Any]) -> list[Manifest]:
    return found["rendered"][0]["manifests"]


@pytest.fixture
def everything(found: dict[str, Any]) -> list[Manifest]:
    return found["rendered"][1]["manifests"]


def of_kind(manifests: list[Manifest], kind: str) -> dict[str, Manifest]:
    """Manifests by the part that they are for."""
    return {
        manifest["metadata"]["labels"]["app.kubernetes.io/component"]: manifest
        for manifest in manifests
        if manifest["kind"] == kind
    }


def pods(manifests: list[Manifest]) -> dict[str, Manifest]:
    """The pods' specifications by part."""
    deployments = of_kind(manifests, "Deployment")
    return {part: each["spec"]["template"]["spec"] for part, each in deployments.items()}


def containers(manifests: list[Manifest]) -> dict[str, Manifest]:
    return {part: each["containers"][0] for part, each in pods(manifests).items()}


def given(container: Manifest) -> list[str]:
    """The names of the Secrets a container is given."""
    return [each["secretRef"]["name"] for each in container["envFrom"] if "secretRef" in each]


def test_helm_has_nothing_against_it(found: dict[str, Any]) -> None:
    assert found["lint"]["errors"] == []
    assert [each for each in found["lint"]["messages"] if each["severity"] > 1] == []


def test_kubernetes_accepts_what_it_makes(found: dict[str, Any]) -> None:
    for made in found["rendered"][:2]:
        assert made["error"] is None
        assert made["faults"] == []
        assert made["notes"]


@pytest.mark.parametrize("number", range(len(REFUSED)))
def test_values_that_cannot_be_meant_are_refused(found: dict[str, Any], number: int) -> None:
    made = found["rendered"][2 + number]

    assert made["manifests"] == []
    assert REFUSED[number][1] in made["error"]


def test_its_own_values_fit_its_schema() -> None:
    schema = json.loads((PLACE / "values.schema.json").read_text())

    jsonschema.Draft7Validator.check_schema(schema)
    jsonschema.validate(yaml.safe_load((PLACE / "values.yaml").read_text()), schema)


def test_it_is_of_the_version_of_the_program(bucket: list[Manifest]) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    chart = yaml.safe_load((PLACE / "Chart.yaml").read_text())

    assert (chart["version"], chart["appVersion"]) == (version, version)
    assert {each["image"] for each in containers(bucket).values()} == {f"meshcone:{version}"}


def test_every_part_runs_a_command_that_exists(manifests: list[Manifest]) -> None:
    commands = {command.name for command in command_line().registered_commands}

    started = {part: each["args"][0] for part, each in containers(manifests).items()}

    assert started == {part: part for part in PARTS}
    assert set(started.values()) <= commands


def test_every_setting_that_it_makes_exists(manifests: list[Manifest]) -> None:
    [settings] = of_kind(manifests, "ConfigMap").values()

    ours = {name for name in settings["data"] if name.startswith("MESHCONE_")}
    assert ours <= SETTINGS
    assert all(isinstance(value, str) for value in settings["data"].values())


def test_a_pod_can_do_little(manifests: list[Manifest]) -> None:
    for pod in pods(manifests).values():
        assert pod["automountServiceAccountToken"] is False
        assert pod["securityContext"]["runAsNonRoot"] is True
        assert pod["securityContext"]["runAsUser"] == 10001
        assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
        [container] = pod["containers"]
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        }
        assert container["resources"]["limits"]["memory"]


def test_workers_are_not_given_the_secrets_of_those_who_go_out(everything: list[Manifest]) -> None:
    secrets = {part: given(each) for part, each in containers(everything).items()}

    assert secrets.pop("worker") == ["broker"]
    assert all(names == ["broker", "outbound"] for names in secrets.values())


def test_a_worker_reaches_names_broker_and_files_and_nobody_reaches_it(
    bucket: list[Manifest], everything: list[Manifest]
) -> None:
    for manifests, ports in ((bucket, [53, 53, 6379, 443]), (everything, [53, 53, 6379])):
        policy = of_kind(manifests, "NetworkPolicy")["worker"]["spec"]
        assert policy["policyTypes"] == ["Ingress", "Egress"]
        assert policy["ingress"] == []
        assert [port["port"] for rule in policy["egress"] for port in rule["ports"]] == ports
    broker = of_kind(everything, "NetworkPolicy")["worker"]["spec"]["egress"][1]
    assert broker["to"] == [{"ipBlock": {"cidr": "10.20.0.7/32"}}]


def test_what_goes_out_does_not_reach_private_addresses(manifests: list[Manifest]) -> None:
    policies = of_kind(manifests, "NetworkPolicy")

    assert set(policies) == set(PARTS)
    for part in PARTS:
        blocks = [
            peer["ipBlock"]
            for rule in policies[part]["spec"]["egress"]
            if "ports" not in rule
            for peer in rule["to"]
        ]
        assert bool(blocks) == (part in ("webhooks", "transfers"))
        assert all({"10.0.0.0/8", "169.254.0.0/16"} <= set(each["except"]) for each in blocks)


def test_policies_and_services_are_about_the_pods_they_name(manifests: list[Manifest]) -> None:
    labels = {
        part: each["spec"]["template"]["metadata"]["labels"]
        for part, each in of_kind(manifests, "Deployment").items()
    }
    for part, each in of_kind(manifests, "NetworkPolicy").items():
        selected = each["spec"]["podSelector"]["matchLabels"].items()
        assert [name for name in labels if selected <= labels[name].items()] == [part]
    [service] = of_kind(manifests, "Service").values()
    assert service["spec"]["selector"].items() <= labels["api"].items()


def test_probes_ask_what_there_is(manifests: list[Manifest]) -> None:
    paths = json.loads((ROOT / "openapi" / "openapi.json").read_text())["paths"]
    [port] = re.findall(r"^EXPOSE (\d+)", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    api, worker = (containers(manifests)[part] for part in ("api", "worker"))

    assert [each["containerPort"] for each in api["ports"]] == [int(port)]
    for kind in ("startupProbe", "livenessProbe", "readinessProbe"):
        assert api[kind]["httpGet"]["path"] in paths
        assert api[kind]["httpGet"]["port"] == api["ports"][0]["name"]
    for kind in ("startupProbe", "livenessProbe"):
        *python, module = worker[kind]["exec"]["command"]
        assert python == ["python", "-m"]
        assert importlib.util.find_spec(module) is not None


def test_a_worker_is_not_killed_before_it_has_handed_its_job_back(
    manifests: list[Manifest],
) -> None:
    [settings] = of_kind(manifests, "ConfigMap").values()
    grace = int(settings["data"]["MESHCONE_STOP_GRACE"])

    assert pods(manifests)["worker"]["terminationGracePeriodSeconds"] >= grace + 10


def test_a_worker_may_take_what_a_job_may_take(manifests: list[Manifest]) -> None:
    limit = containers(manifests)["worker"]["resources"]["limits"]["memory"]

    room = int(limit.removesuffix("Gi")) * 2**30 - WorkerSettings().job_memory_bytes
    assert room >= 2**29


def test_files_are_in_the_bucket_or_in_the_volume_of_all_who_need_them(
    bucket: list[Manifest], everything: list[Manifest]
) -> None:
    [settings] = of_kind(bucket, "ConfigMap").values()
    assert settings["data"]["MESHCONE_BLOB_URL"] == "s3://assets/meshcone"
    shared = {
        part
        for part, pod in pods(everything).items()
        for volume in pod["volumes"]
        if volume.get("persistentVolumeClaim") == {"claimName": "assets"}
    }
    assert shared == {"api", "worker", "transfers"}


def test_workers_are_as_many_as_the_jobs_that_the_metrics_count(everything: list[Manifest]) -> None:
    worker = of_kind(everything, "Deployment")["worker"]
    scaled = of_kind(everything, "ScaledObject")["worker"]["spec"]
    [service] = of_kind(everything, "Service").values()
    served = (ROOT / "service" / "api" / "routes" / "metrics.py").read_text()

    assert "replicas" not in worker["spec"]
    assert scaled["scaleTargetRef"]["name"] == worker["metadata"]["name"]
    assert scaled["minReplicaCount"] >= 1
    for trigger in scaled["triggers"]:
        said = trigger["metadata"]
        assert f'"{said["valueLocation"].partition("{")[0]}"' in served
        assert said["url"] == f"http://{service['metadata']['name']}.assets.svc:80/metrics"
