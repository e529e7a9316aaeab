"""What flappy-gap mcap writes, read as the viewers do that cannot be had here: viewers_test.py BIN SOURCE WORK.

The messages by the packages mcap and mcap-ros2-support, by the definitions in the file. The panels of the layout for Foxglove by the types of
foxglove-sdk, which publishes them; that for PlotJuggler by the structure that its source reads. Each series of a layout has to be in the file.
"""
import csv
import dataclasses
import json
import math
import re
import shutil
import subprocess
import sys
import types
import typing
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from foxglove import layouts
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

BIN, SOURCE, WORK = (Path(p).resolve() for p in sys.argv[1:4])
VEHICLE = SOURCE / "configs/vehicles/hummingbird_nominal.toml"
AXES = [(member, axis) for member in ("linear_acceleration", "angular_velocity") for axis in "xyz"]


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def read(file):
    """[topic] list of (stamp, message)."""
    seen = {}
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        assert all(s.encoding == "ros2msg" for s in reader.get_summary().schemas.values())
        for _, channel, message, decoded in reader.iter_decoded_messages():
            seen.setdefault(channel.topic, []).append((message.publish_time, decoded))
    return seen


def member(message, path):
    for name in path.split("."):
        message = getattr(message, name)
    return message


def rms(messages, path):
    return math.sqrt(sum(member(m, path) ** 2 for _, m in messages) / len(messages))


def check_messages(seen, flight):
    for topic, stream in (("/imu", "imu"), ("/pose", "mocap"), ("/tf", "mocap"), ("/wing_input", "command")):
        with (flight / f"{stream}.csv").open() as table:
            assert len(seen[topic]) == sum(1 for _ in csv.reader(table)) - 1, topic
    imu = dict(seen["/imu"])
    for vehicle in ("/declared", "/corrected"):
        predicted = dict(seen[vehicle + "/imu"])
        assert len(predicted) > 0.9 * len(imu) and predicted.keys() == dict(seen[vehicle + "/residual"]).keys()
        for stamp, left in seen[vehicle + "/residual"]:
            for group, axis in AXES:
                difference = member(imu[stamp], f"{group}.{axis}") - member(predicted[stamp], f"{group}.{axis}")
                assert abs(member(left, f"{group}.{axis}") - difference) < 1e-12, (vehicle, stamp, group, axis)
    # The cable pulls sideways where the robot is to its side, and down where it is high.
    for axis in "xyz":
        path = f"accel.linear.{axis}"
        share = rms(seen["/corrected/beat_residual"], path) / rms(seen["/declared/beat_residual"], path)
        assert share < 0.6, (path, share)


def accepted(kind, value, where):
    """Whether the published type takes a value of a layout, with all of its keys."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        faults = []
        for one in inner:
            try:
                return accepted(one, value, where)
            except AssertionError as fault:
                faults.append(str(fault))
        raise AssertionError("; ".join(faults))
    if origin is typing.Literal:
        assert value in inner, f"{where}: {value}; accepted: {inner}"
    elif origin is list:
        for i, one in enumerate(value):
            accepted(inner[0], one, f"{where}[{i}]")
    elif origin is dict:
        for key, one in value.items():
            accepted(inner[1], one, f"{where}.{key}")
    elif origin is tuple:
        assert len(value) == len(inner), where
    elif dataclasses.is_dataclass(kind):
        assert isinstance(value, dict), where
        hints = typing.get_type_hints(kind, vars(layouts))
        for key, one in value.items():
            name = re.sub("[A-Z]", lambda m: "_" + m[0].lower(), key)
            assert name in hints, f"{where}.{key}: is in no {kind.__name__}"
            accepted(hints[name], one, f"{where}.{key}")
    else:
        numeric = kind is float and isinstance(value, int) and not isinstance(value, bool)
        assert numeric or isinstance(value, kind), f"{where}: {value} is no {kind}"


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert set(node) == {"direction", "first", "second", "splitPercentage"} and node["direction"] in ("row", "column"), node
    return leaves(node["first"]) + leaves(node["second"])


def check_foxglove(file, seen):
    layout = json.loads(file.read_text())
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    series = 0
    for panel, config in layout["configById"].items():
        kind = {"3D": layouts.ThreeDeeConfig, "Plot": layouts.PlotConfig}[panel.split("!")[0]]
        accepted(kind, {k: v for k, v in config.items() if k != "foxglovePanelTitle"}, panel)
        for topic in config.get("topics", {}):
            assert topic in seen, topic
        for path in config.get("paths", []):
            topic, _, rest = path["value"].partition(".")
            assert isinstance(member(seen[topic][0][1], rest), float), path
            assert hasattr(seen[topic][0][1], "header")  # whose stamp is the time
            series += 1
    frames = {t.header.frame_id for _, m in seen["/tf"] for t in m.transforms}
    assert layout["configById"]["3D!robot"]["followTf"] in frames
    return series


def check_plotjuggler(file, seen):
    root = ElementTree.parse(file).getroot()
    assert root.tag == "root" and root.get("version") == "2.3.8"
    (tabs,) = root.findall("tabbed_widget")
    assert tabs.get("parent") == "main_window" and tabs.get("name")
    curves = 0

    def check(element):
        nonlocal curves
        if element.tag == "DockArea":
            (plot,) = element.findall("plot")
            assert plot.get("mode") == "TimeSeries" and plot.get("style") == "Lines"
            for curve in plot.findall("curve"):
                topic = max((t for t in seen if curve.get("name").startswith(t + "/")), key=len)
                path = curve.get("name")[len(topic) + 1 :].replace("/", ".")
                assert isinstance(member(seen[topic][0][1], path), float), curve.get("name")
                assert re.fullmatch("#[0-9a-f]{6}", curve.get("color"))
                curves += 1
            return
        assert element.tag == "DockSplitter" and element.get("orientation") in ("|", "-")
        sizes = [float(s) for s in element.get("sizes").split(";")]
        assert int(element.get("count")) == len(element) == len(sizes) and abs(sum(sizes) - 1) < 1e-3
        for child in element:
            check(child)

    for tab in tabs.findall("Tab"):
        for container in tab.findall("Container"):
            (splitter,) = container
            check(splitter)
    return curves


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    run(BIN / "flappy-blind", "fly", "--vehicle", VEHICLE, "--effect", "tether=2", "--seed", "3", "--no-truth", "--out", WORK / "flights")
    flights = sorted(p.parent for p in (WORK / "flights").glob("*/flight.toml"))
    run(BIN / "flappy-gap", "diagnose", "--vehicle", VEHICLE, "--flights", *flights, "--out", WORK / "diagnosis")
    out = WORK / "flight.mcap"
    print(run(BIN / "flappy-gap", "mcap", flights[1], "--vehicle", VEHICLE, "--diagnosis", WORK / "diagnosis", "--out", out))
    seen = read(out)
    check_messages(seen, flights[1])
    print(check_foxglove(WORK / "flight.foxglove.json", seen), "series for Foxglove,", check_plotjuggler(WORK / "flight.plotjuggler.xml", seen), "for PlotJuggler")


if __name__ == "__main__":
    main()
