"""Validation of JSON documents against the schemas of the package."""

import json
from importlib.resources import files

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

SCHEMAS = {
    path.name.removesuffix(".json"): json.loads(path.read_text("utf-8"))
    for path in (files("allanite") / "schemas").iterdir()
}
_REGISTRY = Registry().with_resources(
    [(schema["$id"], Resource.from_contents(schema)) for schema in SCHEMAS.values()]
)


def valid(document):
    """The document after a round trip through JSON; an error if its schema rejects it."""
    plain = json.loads(json.dumps(document, allow_nan=False))
    name = plain["schema"].split("/")[1]
    assert SCHEMAS[name]["$id"] == plain["schema"].replace("/", ":").replace(
        "allanite", "urn:allanite"
    )
    validator = Draft202012Validator(SCHEMAS[name], registry=_REGISTRY)
    errors = [f"{e.json_path}: {e.message}" for e in validator.iter_errors(plain)]
    assert not errors, errors
    return plain
