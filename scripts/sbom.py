#!/usr/bin/env python3
"""Writes what a release stands on, as CycloneDX: sbom.py BUILD OUT, for scripts/release.

Compiled in is what the compiler read: the packages of all headers that the build names, and of the scripts in its pages. A Debian
package needs what it depends on. A wheel carries the libraries that auditwheel lists in it, and needs what its metadata say.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import uuid
import zipfile
from datetime import UTC, datetime
from email import message_from_bytes
from importlib.metadata import version
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType, Property
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL


def said(*command: str | Path, cwd: Path | None = None) -> str:
    return subprocess.run(command, cwd=cwd, check=True, capture_output=True, text=True).stdout


def library(purl: PackageURL) -> Component:
    return Component(name=purl.name, version=purl.version, type=ComponentType.LIBRARY, purl=purl, bom_ref=str(purl))


def of_debian(names: set[str]) -> set[Component]:
    """The installed packages of these names, or that provide them; without a version where none is installed."""
    found = {}
    for line in said("dpkg-query", "-W", "-f=${Package} ${Version} ${Architecture}\n").splitlines():
        name, *rest = line.split()
        found[name] = rest
    purls = (
        PackageURL("deb", "debian", n, found[n][0], {"arch": found[n][1], "distro": "debian-12"})
        if n in found
        else PackageURL("deb", "debian", n)
        for n in names
    )
    return {library(purl) for purl in purls}


def compiled_in(build: Path) -> set[Component]:
    files = {line.strip() for line in said("ninja", "-t", "deps", cwd=build).splitlines() if line.startswith("    /usr/")}
    files |= {match[1] for match in re.finditer(r"^(?:THREE|CHART)_JS:\w+=(.*)$", (build / "CMakeCache.txt").read_text(), re.M)}
    owners = said("dpkg", "-S", *sorted(os.path.realpath(f) for f in files))
    return of_debian({line.rpartition(": ")[0].split(",")[0].split(":")[0] for line in owners.splitlines()})


def needs_of_deb(deb: Path) -> set[Component]:
    depends = said("dpkg-deb", "-f", deb, "Depends").strip()
    return of_debian({re.split(r"[ :(|]", each.strip())[0] for each in depends.split(",") if each.strip()})


def needs_of_wheel(wheel: Path) -> set[Component]:
    found = {library(PackageURL("pypi", None, "nanobind", version("nanobind")))}
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if ".dist-info/sboms/" in name and name.endswith(".json"):
                for each in json.loads(archive.read(name))["components"]:
                    if each["purl"].startswith("pkg:deb"):
                        found.add(library(PackageURL.from_string(each["purl"])))
            elif name.endswith(".dist-info/METADATA"):
                for need in message_from_bytes(archive.read(name)).get_all("Requires-Dist"):
                    if "extra ==" not in need:
                        found.add(library(PackageURL("pypi", None, re.match(r"[\w-]+", need)[0])))
    return found


def main(build: Path, out: Path) -> None:
    number = re.search(r"project\(flappy VERSION ([\d.]+)", Path("CMakeLists.txt").read_text())[1]
    commit = said("git", "rev-parse", "HEAD").strip()
    whole = Component(name="flappy", version=number, type=ComponentType.APPLICATION, bom_ref="flappy")
    whole.properties.add(Property(name="flappy:commit", value=commit))
    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_OID, commit))
    bom.metadata.timestamp = datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), UTC)
    bom.metadata.component = whole
    known: dict[str, Component] = {}
    built_from = compiled_in(build)
    files = []
    for path in sorted([*out.glob("*.deb"), *out.glob("*.whl")]):
        digest = HashType(alg=HashAlgorithm.SHA_256, content=hashlib.sha256(path.read_bytes()).hexdigest())
        file = Component(name=path.name, type=ComponentType.FILE, bom_ref=path.name, hashes=[digest])
        needs = built_from | (needs_of_deb(path) if path.suffix == ".deb" else needs_of_wheel(path))
        bom.components.add(file)
        files.append(file)
        bom.register_dependency(file, [known.setdefault(each.bom_ref.value, each) for each in sorted(needs)])
    bom.components |= known.values()
    bom.register_dependency(whole, files)
    text = make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=1)
    if wrong := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text):
        sys.exit(f"the SBOM is not CycloneDX: {wrong}")
    (out / f"flappy-{number}.cdx.json").write_text(text + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
