"""What the module itself does: batches, fleets, environments, flights, policies, and what it says of bad inputs."""

import copy
import multiprocessing
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import flappy
from flappy import _core

HOVER = "fly/hover_direct.toml"


def environments(count: int = 2, autoreset: str = "same_step", copy: bool = True, *overrides: str) -> _core.Environments:
    return _core.Environments(Path(HOVER), list(overrides), count, autoreset, copy)


def actions(count: int, step: int, first: int = 0) -> np.ndarray:
    i, k = np.meshgrid(np.arange(first, first + count), np.arange(4), indexing="ij")
    return (0.4 * np.sin(i + 0.7 * k + 0.3 * step)).astype(np.float32)


def test_a_batch_does_not_depend_on_its_size():
    vehicle = flappy.Vehicle("vehicles/hummingbird_nominal.toml")
    positions = []
    for count, threads in ((1, 1), (40, 2)):
        batch = flappy.Batch(count, vehicle, threads=threads, precision="float")
        batch.set_inputs([9.8, 0.1, 0, 0])
        batch.step(400)
        state = batch.states()
        assert state["attitude"].shape == (count, 4)
        assert state["stroke_rad"].dtype == np.float64
        positions.append(state["position_m"])
    assert (positions[1] == positions[0][0]).all()
    assert np.abs(positions[0]).max() > 1e-4


def test_a_batch_takes_voltages():
    batch = flappy.Batch(2, flappy.Vehicle("vehicles/hummingbird_nominal.toml"))
    batch.set_voltages([[3, 3], [3, -3]])
    batch.step(20)
    rate = batch.states()["stroke_rate_rad_s"]
    assert rate[0, 0] > 1
    assert rate[0] == pytest.approx(rate[0, ::-1], rel=1e-3)  # mirrored axes: the same way on both sides
    assert rate[1, 0] > 0 > rate[1, 1]


def test_a_welded_flapper_pulls_at_its_stand():
    batch = flappy.Batch(2, flappy.Vehicle("vehicles/hummingbird_nominal.toml"))
    batch.reset(1, start="welded")
    batch.set_inputs([10, 0, 0, 0])
    batch.step(4000)  # 1 s
    assert batch.support() == ["flying", "welded"]
    assert batch.held_impulse()[1, 2] == pytest.approx(0.012 * 9.81, rel=0.2)  # about what carries 12 g


def test_a_batch_takes_states_and_vehicles():
    vehicle = flappy.Vehicle("vehicles/hummingbird_nominal.toml")
    heavy = vehicle.copy()
    heavy["torso.mass_kg"] *= 1.1
    assert heavy["torso.mass_kg"] == pytest.approx(1.1 * vehicle["torso.mass_kg"])
    batch = flappy.Batch(2, vehicle, world=flappy.World(gravity_m_s2=5))
    batch.set_vehicle(1, heavy)
    for i in range(2):
        batch.reset(i, {"position_m": [0, 0, 1], "velocity_m_s": np.array([0.5, 0, 0])})
    batch.step(400)
    position = batch.states()["position_m"]
    # free fall: z = 1 - g t^2 / 2 with g = 5 and t = 0.1 s, less what the wings' drag holds up
    assert position[:, 2] == pytest.approx(1 - 0.5 * 5 * 0.01, abs=0.005)
    assert position[0, 2] != position[1, 2]


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda b: b.set_inputs([1, 2]), ValueError, "inputs: is int64 of shape (2,); accepted: float64 of shape (2, 4) or (4,)"),
        (lambda b: b.set_inputs([np.nan] * 4), ValueError, "inputs: is not finite"),
        (lambda b: b.reset(2), IndexError, "index 2: accepted: -2 to 1"),
        (lambda b: b.reset(0, {"place": [1]}), KeyError, 'no part "place"; accepted: position_m, attitude'),
        (lambda b: b.reset(0, {"position_m": [1]}), ValueError, "position_m: is int64 of shape (1,); accepted: float64 of shape (3,)"),
        (lambda b: b.reset(0, start="sitting"), ValueError, 'start: is "sitting"; accepted: flying, standing, welded'),
        (lambda b: b.reset(0, {"attitude": [1, 0, np.nan, 0]}), ValueError, "attitude: is not finite"),
        (lambda b: b.step(-1), ValueError, ""),
        (lambda b: flappy.Wall(0, 0, 2, 0), ValueError, "normal: its length is not 1"),
        (lambda b: flappy.fly("fly/hover.toml", count=0), ValueError, "count: is 0; accepted: 1 and more"),
        (lambda b: b.energy_J(), ValueError, "meters_energy"),
    ],
)
def test_a_batch_refuses(call, error, said):
    with pytest.raises(error) as refused:
        call(flappy.Batch(2, flappy.Vehicle("vehicles/hummingbird_nominal.toml")))
    assert said in str(refused.value)


def test_a_vehicle_refuses():
    vehicle = flappy.Vehicle("vehicles/hummingbird_nominal.toml")
    with pytest.raises(KeyError, match="did you mean"):
        vehicle["left.motor.resistence_ohm"]
    with pytest.raises(ValueError, match=r"torso\.mass_kg: is -1; accepted"):
        vehicle["torso.mass_kg"] = -1
    with pytest.raises(flappy.InputError, match=r"nowhere\.toml: cannot be read"):
        flappy.Vehicle("nowhere.toml")


def test_a_fleet_flies_as_flappy_fly(tmp_path):
    fleet = flappy.Fleet("fly/hover.toml", 2, ["flight.duration_s=1"])
    fleet.step(500)
    assert fleet.t_s == pytest.approx(1)
    flown = flappy.fly("fly/hover.toml", ["flight.duration_s=1"], count=2, log=tmp_path / "logs")
    assert flown["hash"] == fleet.hash()
    assert flown["logs"] == 2
    truth = fleet.truth()
    assert truth["position_m"].shape == (2, 3)
    assert np.abs(truth["position_m"] - fleet.estimate()["position_m"]).max() < 0.01
    assert fleet.observations().dtype == np.float32
    assert fleet.rewards().shape == fleet.ended().shape == (2,)


def test_vehicles_batches_and_fleets_are_pickled_and_copied():
    vehicle = flappy.Vehicle("vehicles/hummingbird_nominal.toml")
    vehicle["left.motor.resistance_ohm"] = 4.25
    world = flappy.World(ground_z_m=-0.5, walls=[flappy.Wall(1, 0, -1, 0)])
    for twin in (pickle.loads(pickle.dumps(vehicle)), copy.copy(vehicle), copy.deepcopy(vehicle)):
        assert twin.text == vehicle.text
        twin["left.motor.resistance_ohm"] = 4.5
        assert vehicle["left.motor.resistance_ohm"] == 4.25

    def step(flown):
        if isinstance(flown, flappy.Batch):
            flown.set_inputs([9.8, 0.1, 0, 0])
        flown.step(40)
        return flown.hash()

    for make in (
        lambda: flappy.Batch(3, vehicle, world=world, meters_energy=True, precision="float"),
        lambda: flappy.Batch(3, vehicle),
        lambda: flappy.Fleet("fly/hover.toml", 2, ["flight.seed=7"]),
    ):
        original = make()
        made_again = pickle.loads(pickle.dumps(original))
        assert step(made_again) == step(original)
        twin, other = copy.deepcopy(original), copy.copy(original)
        other.step(1)
        assert step(original) == step(twin) != other.hash()


def test_environments_that_add_nothing_fly_as_flappy_fly():
    env = _core.Environments(Path("fly/waypoints.toml"), [], 3, "same_step", True)
    env.reset(env.seed)
    for _ in range(500):
        env.step(np.zeros((3, 4), np.float32))
    assert env.hash(0, 3) == flappy.fly("fly/waypoints.toml", ["flight.duration_s=1"], count=3)["hash"]


def test_flights_come_back_as_they_were_written(tmp_path):
    flappy.fly("fly/hover.toml", ["flight.duration_s=0.5"], log=tmp_path / "a")
    flight = flappy.read_flight(tmp_path / "a")
    assert {"header", "command", "mocap", "imu"} <= set(flight)
    flappy.write_flight(tmp_path / "b", flight)
    again = flappy.read_flight(tmp_path / "b")
    for stream in ("command", "mocap", "imu"):
        for name, column in flight[stream].items():
            assert (again[stream][name] == column).all(), name
    flight["mocap"]["t_s"][3] = 0
    with pytest.raises(flappy.InputError, match=r"mocap\.csv:5: t_s"):
        flappy.write_flight(tmp_path / "c", flight)
    assert not (tmp_path / "c").exists()
    with pytest.raises(flappy.InputError, match="nowhere"):
        flappy.read_flight(tmp_path / "nowhere")


def course(count: int, which: int, copy: bool, first: int, threads: int) -> tuple[int, bytes]:
    env = environments(count, "same_step", copy, "task.end.time_s=0.15", f"flight.first_flapper={first}", f"flight.threads={threads}")
    seen = env.reset(3)[which].tobytes()
    for step in range(40):
        observation, reward, terminated, truncated, _ = env.step(actions(count, step, first))
        seen += observation[which].tobytes() + reward[which].tobytes() + bytes([int(terminated[which]), int(truncated[which])])
    return env.hash(which, which + 1), seen


def test_an_environment_depends_on_its_number_alone():
    alone = course(1, 0, True, 5, 1)
    assert len(alone[1]) == 41 * 72 + 40 * 6
    assert course(8, 5, True, 0, 1) == alone
    assert course(4096, 5, False, 0, 2) == alone
    assert course(4096, 5, True, 0, 1) == alone


def test_arrays_stay_or_are_used_again():
    env = environments(4, "same_step", False)
    env.reset(1)
    views = [env.step(actions(4, k))[0] for k in range(3)]
    assert np.shares_memory(views[0], views[2])
    assert not np.shares_memory(views[0], views[1])
    env = environments(4, "same_step", True)
    env.reset(1)
    copies = [env.step(actions(4, k))[0] for k in range(3)]
    kept = copies[0].copy()
    address = copies[1].ctypes.data
    copies[1] = copies[2] = None
    again = [env.step(actions(4, k))[0] for k in range(3, 8)]
    assert address in [array.ctypes.data for array in again]  # the memory of what nobody looks at is used again
    assert (copies[0] == kept).all()
    env.close()
    assert (copies[0] == kept).all()


@pytest.mark.parametrize(
    ("action", "error", "said"),
    [
        (np.zeros((3, 4), np.float32), ValueError, "action: is float32 of shape (3, 4); accepted: float32 of shape (2, 4)"),
        (np.zeros(8, np.float32), ValueError, "action: is float32 of shape (8,); accepted: float32 of shape (2, 4)"),
        (np.zeros((2, 4), np.int32), TypeError, "action: is int32 of shape (2, 4); accepted: float32 of shape (2, 4)"),
        (np.zeros((2, 4), np.complex64), TypeError, "action: is complex64 of shape (2, 4)"),
        (None, TypeError, "action: is object of shape ()"),
        ("up", TypeError, "action: is str"),
        ([[0, 0, 0, 0], [0, 0, 0, np.nan]], ValueError, "action[1][3]: is nan, one of 1 outside; accepted: float32 of shape (2, 4)"),
        ([[0, -1.5, 0, 0], [0, 0, 0, np.inf]], ValueError, "action[0][1]: is -1.5, one of 2 outside"),
    ],
)
def test_a_step_refuses(action, error, said):
    env = environments()
    env.reset(1)
    before = env.hash(0, 2)
    with pytest.raises(error) as refused:
        env.step(action)
    assert said in str(refused.value)
    assert env.hash(0, 2) == before


def test_actions_of_other_layouts_are_taken():
    results = []
    for action in (actions(2, 0), actions(2, 0).astype(np.float64), np.asfortranarray(actions(2, 0)), actions(2, 0).tolist()):
        env = environments()
        env.reset(1)
        results.append(env.step(action)[0])
    assert all((result == results[0]).all() for result in results)


def test_an_environment_refuses():
    with pytest.raises(ValueError, match="num_envs: is 0; accepted: 1 to 1000000"):
        environments(0)
    with pytest.raises(flappy.InputError, match="excitation: belongs to flights"):
        _core.Environments(Path("fly/identify_multisine.toml"), [], 1, "disabled", True)
    with pytest.raises(flappy.InputError, match=r"task\.end\.tim_s"):
        environments(1, "disabled", True, "task.end.tim_s=1")
    env = environments(2, "disabled")
    env.reset(1)
    with pytest.raises(ValueError, match=r"reset_mask: has shape \(3,\); accepted: bool of shape \(2,\)"):
        env.reset_some(np.zeros(3, bool))
    env.close()
    for call in (lambda: env.step(actions(2, 0)), lambda: env.reset(1), lambda: env.pose(0), lambda: env.hash(0, 1)):
        with pytest.raises(RuntimeError, match="the environment is closed"):
            call()
    env.close()  # once more is no error


def test_two_threads_on_one_environment():
    env = environments(4096)
    env.reset(1)
    said = []

    def fly() -> None:
        for step in range(60):
            try:
                env.step(actions(4096, step))
            except RuntimeError as e:
                said.append(str(e))

    threads = [threading.Thread(target=fly) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert said
    assert set(said) == {"the environment: another thread is in a call to it; accepted: one call at a time"}


def test_policies_refuse(tmp_path):
    (tmp_path / "p.h").write_text("#define FLAPPY_POLICY_OBS 3\n")
    with pytest.raises(flappy.InputError, match="FLAPPY_POLICY_ACT is missing"):
        flappy.Policy(tmp_path / "p.h")
    with pytest.raises(flappy.InputError, match="is no run folder"):
        flappy.Policy(tmp_path)


def test_a_header_acts(tmp_path):
    (tmp_path / "p.h").write_text(
        "#define FLAPPY_POLICY_OBS 3\n#define FLAPPY_POLICY_ACT 2\n"
        "static void flappy_policy_step(const float obs[3], float action[2]) { action[0] = obs[0] + obs[1]; action[1] = obs[2]; }\n"
        "static int flappy_policy_selftest(void) { return 0; }\n"
    )
    policy = flappy.Policy(tmp_path / "p.h")
    assert policy(np.array([1, 2, 3], np.float32)).tolist() == [3, 3]
    assert policy(np.array([[1, 2, 3], [0, 0, 1]])).tolist() == [[3, 3], [0, 1]]
    assert pickle.loads(pickle.dumps(policy))(np.array([1, 2, 3], np.float32)).tolist() == [3, 3]
    with pytest.raises(ValueError, match=r"accepted: float32 of shape \(1, 3\)"):
        policy(np.zeros(4))


def test_a_header_remembers(tmp_path):
    (tmp_path / "p.h").write_text(
        "#define FLAPPY_POLICY_OBS 1\n#define FLAPPY_POLICY_ACT 1\n#define FLAPPY_POLICY_MEMORY 1\n"
        "static void flappy_policy_of(const float in[2], float out[2]) { out[0] = out[1] = in[0] + in[1]; }\n"  # adds up what it has seen
        "static int flappy_policy_selftest(void) { return 0; }\n"
    )
    policy = flappy.Policy(tmp_path / "p.h")
    seen = np.array([[1], [10]], np.float32)
    assert [policy(seen).tolist() for _ in range(2)] == [[[1], [10]], [[2], [20]]]
    assert policy.memory.tolist() == [[2], [20]]
    policy.reset([True, False])
    assert policy(seen).tolist() == [[1], [30]]
    with pytest.raises(ValueError, match=r"has 1 rows; accepted: 2, as before, or reset\(\) first"):
        policy(seen[0])
    policy.reset()
    assert policy(seen[0]).tolist() == [1]


def test_an_onnx_file_acts(tmp_path):
    pytest.importorskip("onnxruntime")

    def field(number: int, value: int | str | bytes) -> bytes:  # of protobuf's wire format, for numbers and sizes below 128
        if isinstance(value, int):
            return bytes([number << 3, value])
        value = value.encode() if isinstance(value, str) else value
        return bytes([number << 3 | 2, len(value)]) + value

    def side(name: str) -> bytes:  # float[n][3]
        shape = field(1, field(2, "n")) + field(1, field(1, 3))
        return field(1, name) + field(2, field(1, field(1, 1) + field(2, shape)))

    negative = field(1, "observation") + field(2, "action") + field(4, "Neg")
    graph = field(1, negative) + field(2, "policy") + field(11, side("observation")) + field(12, side("action"))
    (tmp_path / "p.onnx").write_bytes(field(1, 8) + field(8, field(2, 17)) + field(7, graph))
    policy = flappy.Policy(tmp_path / "p.onnx")
    assert policy(np.array([1, 2, 3], np.float32)).tolist() == [-1, -2, -3]
    assert policy(np.zeros((2, 3))).shape == (2, 3)


def test_diagnosis_and_identification_refuse(tmp_path):
    with pytest.raises(flappy.InputError, match="nowhere"):
        flappy.diagnose("vehicles/hummingbird_nominal.toml", [str(tmp_path / "nowhere")])
    with pytest.raises(flappy.InputError, match="nowhere"):
        flappy.identify("vehicles/hummingbird_nominal.toml", tmp_path / "nowhere.csv")


def flown(threads: int) -> np.ndarray:
    batch = flappy.Batch(4000, flappy.Vehicle("vehicles/hummingbird_nominal.toml"), threads=threads, precision="float")
    batch.set_inputs([9.8, 0.1, 0, 0])
    for _ in range(3):
        batch.step(8)
    return batch.states()["position_m"]


def test_forked_processes_fly_on_threads_of_their_own():
    wanted = flown(2)  # from now on this process has threads, which a child has not
    with multiprocessing.get_context("fork").Pool(2) as pool:
        for positions in pool.map_async(flown, [2, 1]).get(timeout=60):
            assert (positions == wanted).all()
    assert (flown(2) == wanted).all()


def test_threads_sleep_between_steps():
    """Even where somebody loaded OpenMP before us, whose threads then look on for milliseconds."""
    program = """
import ctypes, time
ctypes.CDLL("libgomp.so.1", mode=ctypes.RTLD_GLOBAL)
import flappy
batch = flappy.Batch(4000, flappy.Vehicle("vehicles/hummingbird_nominal.toml"), threads=2)
spent = []
for _ in range(5):
    batch.step(8)
    before = time.process_time()
    time.sleep(0.05)
    spent.append(time.process_time() - before)
print(min(spent))
"""
    said = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout
    assert float(said) < 1e-3
