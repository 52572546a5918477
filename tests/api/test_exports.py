"""Files of the command line, read back by others' readers, and what controllers would see of them."""

import io
import json
import re
import shlex
import sys
from pathlib import Path

import msgpack
import numpy as np
import pytest
from mcap.reader import make_reader

from api.__main__ import main
from api.controllers import CONTROLLERS
from api.exports import EXPORTS, export_of

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "controllers.md").read_text(encoding="utf-8")

UR = {
    "waypoints": [
        [0, -1.57, 1.57, -1.57, -1.57, 0],
        [0.5, -1.2, 1.3, -1.6, -1.5, 0.3],
        [0.9, -1.4, 1.7, -1.8, -1.2, 0.1],
    ],
    "limits": {"velocity": 2, "acceleration": 8, "jerk": 60},
    "method": "ruckig",
}
FRANKA = {
    "waypoints": [[0, -0.785, 0, -2.356, 0, 1.571, 0.785], [0.5, -0.3, 0.2, -1.8, 0.1, 1.9, 0.3]],
    "limits": {"velocity": 2, "acceleration": 7, "jerk": 3000},
    "method": "ruckig",
}
TIMED = {"waypoints": UR["waypoints"], "times": [0, 1, 2], "method": "minimum_jerk"}
ORDERS = ("position", "velocity", "acceleration", "jerk")


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def call(body, *argv, code=0, command="plan"):
        Path("request.json").write_text(json.dumps(body))
        assert main([command, "request.json", *argv]) == code, capsys.readouterr().err
        captured = capsys.readouterr()
        if code:
            assert captured.err.startswith("waywright: ") and "unexpected" not in captured.err
        assert not list(Path().glob(".*"))
        return captured.out if code == 0 else captured.err

    return call


def answer(path):
    return json.loads(Path(path).read_text())


def rows(body):
    """Return the positions in a URScript program and the seconds that each takes."""
    found = re.findall(r"^  servoj\((\[[^\]]*\]), t=([\d.]+), lookahead_time=0\.1, gain=300\)$", body, re.M)
    return np.array([json.loads(q) for q, _ in found]), {float(t) for _, t in found}


def test_endings():
    assert list(EXPORTS) == [
        ".json", ".msgpack", ".csv", ".arrow", ".npz", ".ros2.json", ".plotly.json",
        ".png", ".html", ".urscript", ".cdr", ".mcap",
    ]  # fmt: skip
    assert export_of("a.ROS2.json").suffix == ".ros2.json" and export_of("ros2.json").suffix == ".json"
    assert export_of("x.txt") is None and export_of("csv") is None


@pytest.mark.parametrize("suffix", EXPORTS)
def test_every_ending_is_written_the_same_twice(run, suffix):
    for name in ("a", "b"):
        assert f"wrote {name}{suffix}" in run(
            TIMED, "--dt", "0.05" if suffix != ".urscript" else "0.002", "--out", name + suffix
        )
    first, second = (Path(name + suffix).read_bytes() for name in ("a", "b"))
    assert first == second and len(first) > 1000
    assert {p.name for p in Path().iterdir()} == {"request.json", "a" + suffix, "b" + suffix}


def test_no_such_ending_names_the_others(run):
    assert ".json, .msgpack, .csv" in run(TIMED, "--out", "x.txt", code=2)


@pytest.mark.parametrize(
    "suffix, extra", [(".png", "plot"), (".html", "formats"), (".mcap", "formats"), (".arrow", "formats")]
)
def test_a_library_that_is_missing_is_named(run, monkeypatch, suffix, extra):
    monkeypatch.setattr("api.exports.installed", lambda library: False)
    err = run(TIMED, "--out", f"x{suffix}", code=2)
    assert f"pip install 'waywright[{extra}]'" in err and not Path(f"x{suffix}").exists()


@pytest.mark.parametrize("suffix", [s for s, row in EXPORTS.items() if row.samples])
def test_files_of_samples_need_them(run, suffix):
    assert "/include" in run(TIMED | {"include": ["polynomial"]}, "--out", f"x{suffix}", code=2)
    assert not Path(f"x{suffix}").exists()


def test_a_picture_and_a_page(run):
    body = TIMED | {"joint_names": ["</script><b>", "b", "c", "d", "e", "f"]}
    run(body, "--out", "x.png")
    assert Path("x.png").read_bytes().startswith(b"\x89PNG\r\n")
    run(body, "--out", "x.html")
    text = Path("x.html").read_text(encoding="utf-8")
    assert "src=" not in re.sub(r"<script>.*?</script>\n</head>", "", text, flags=re.S)  # nothing from elsewhere
    (figure,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    run(body, "--out", "x.plotly.json")
    assert json.loads(figure) == answer("x.plotly.json")


def test_msgpack_in_and_out(run, tmp_path):
    run(TIMED, "--out", "x.json")
    run(TIMED, "--out", "x.msgpack")
    assert msgpack.unpackb(Path("x.msgpack").read_bytes()) == answer("x.json")
    Path("request.msgpack").write_bytes(msgpack.packb(TIMED))
    assert main(["plan", "request.msgpack", "--out", "y.json"]) == 0
    assert answer("y.json") == answer("x.json")
    Path("bad.msgpack").write_bytes(b"\x91")
    assert main(["plan", "bad.msgpack"]) == 2


def read_cdr(raw):
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.LATEST).deserialize_cdr(raw, "trajectory_msgs/msg/JointTrajectory")


def same_message(message, expected):
    assert list(message.joint_names) == expected["joint_names"]
    assert len(message.points) == len(expected["points"])
    for point, other in zip(message.points, expected["points"], strict=True):
        for name in ("positions", "velocities", "accelerations"):
            assert getattr(point, name).tolist() == other[name]
        assert len(point.effort) == 0
        found = {"sec": point.time_from_start.sec, "nanosec": point.time_from_start.nanosec}
        assert found == other["time_from_start"]


def test_ros2_messages_are_read_back(run):
    for suffix in (".ros2.json", ".cdr", ".mcap"):
        run(TIMED, "--dt", "0.03", "--out", f"x{suffix}")
    expected = answer("x.ros2.json")
    same_message(read_cdr(Path("x.cdr").read_bytes()), expected)
    with open("x.mcap", "rb") as file:
        ((schema, channel, message),) = make_reader(file, validate_crcs=True).iter_messages()
    assert schema.name == "trajectory_msgs/msg/JointTrajectory" and schema.encoding == "ros2msg"
    assert channel.topic == "/joint_trajectory_controller/joint_trajectory" and channel.message_encoding == "cdr"
    assert message.log_time == 0 and message.data == Path("x.cdr").read_bytes()


def test_a_hold_has_one_point(run):
    body = {"waypoints": [[1, 2], [1, 2]], "limits": UR["limits"]}
    run(body, "--out", "x.cdr")
    assert len(read_cdr(Path("x.cdr").read_bytes()).points) == 1


# ---- controllers


@pytest.mark.parametrize("name, body, dt", [("ur", UR, None), ("ur", UR, 0.008), ("franka", FRANKA, None)])
def test_what_a_controller_sees_is_within_the_limits(run, name, body, dt):
    out = run(body, "--controller", name, *(["--dt", str(dt)] if dt else []), "--out", "x.json")
    tree, period = answer("x.json"), dt or CONTROLLERS[name].period
    times, q = np.array(tree["samples"]["time"]), np.array(tree["samples"]["position"])
    steps = len(times) - 1
    assert (steps - 1) * period < tree["duration"] <= steps * period
    np.testing.assert_allclose(times, period * np.arange(steps + 1), atol=1e-12)
    assert np.abs(q[[0, -1]] - [body["waypoints"][0], body["waypoints"][-1]]).max() < 1e-9
    for order in ORDERS[1:]:
        assert np.abs(tree["samples"][order][-1]).max() == 0.0
    assert "at rest at the end" in out and f"as {name} sees them" in out
    assert [note["code"] for note in tree["warnings"]] == ["held"]
    for order, bound in enumerate(body["limits"].values(), 1):
        padded = np.concatenate([np.repeat(q[:1], order, 0), q, np.repeat(q[-1:], order, 0)])
        assert np.abs(np.diff(padded, order, axis=0)).max() <= bound * period**order * (1 + 1e-6) + 1e-12


def test_whole_periods_need_no_note(run):
    out = run(TIMED, "--controller", "ur", "--out", "x.json")
    tree = answer("x.json")
    assert "note" not in out and len(tree["samples"]["time"]) == 1001 and tree["samples"]["time"][-1] == 2.0


def test_controllers_formats_agree(run):
    for suffix in (".json", ".npz", ".csv", ".msgpack", ".urscript", ".cdr"):
        run(UR, "--controller", "ur", "--out", f"x{suffix}")
    samples = answer("x.json")["samples"]
    with np.load(io.BytesIO(Path("x.npz").read_bytes())) as read:
        for name in ("time", *ORDERS):
            assert read[name].tolist() == samples[name]
    table = np.loadtxt("x.csv", delimiter=",", skiprows=1)
    assert table[:, 1:7].tolist() == samples["position"] and table[:, 0].tolist() == samples["time"]
    assert msgpack.unpackb(Path("x.msgpack").read_bytes())["samples"] == samples
    points = read_cdr(Path("x.cdr").read_bytes()).points
    assert [p.time_from_start.nanosec + 10**9 * p.time_from_start.sec for p in points] == [
        2_000_000 * k for k in range(len(points))
    ]
    program = Path("x.urscript").read_text()
    positions, periods = rows(program)
    assert periods == {0.002} and np.abs(positions - samples["position"]).max() <= 0.5e-9 + 1e-15
    assert program.count("servoj(") == len(positions) and "e-" not in program
    starts, ends = (len(re.findall(rf"^ *{words}", program, re.M)) for words in ("(?:def|while|if) ", "end$"))
    assert starts == ends == 3


def test_a_program_needs_six_joints_and_one_period(run):
    err = run(UR, "--dt", "0.002", "--out", "x.urscript", code=2)
    assert "--controller ur" in err and "apart" in err
    run(TIMED, "--dt", "0.002", "--out", "x.urscript")
    assert rows(Path("x.urscript").read_text())[1] == {0.002}
    assert "whole multiple" in run(TIMED, "--dt", "0.003", "--out", "y.urscript", code=2)
    assert "6 joints" in run(FRANKA, "--dt", "0.002", "--out", "y.urscript", code=2)
    assert not Path("y.urscript").exists()


@pytest.mark.parametrize(
    "name, body, words",
    [
        ("franka", UR, ["franka has 7 joints", "6"]),
        ("ur", TIMED | {"method": "linear"}, ["joint 0, sample 0", "velocity 0.5", "bound 0"]),
        ("franka", FRANKA | {"method": "trapezoidal", "limits": {"acceleration": 2}}, ["sample 0", "acceleration"]),
        (
            "franka",
            FRANKA | {"waypoints": [[0, 0, 0, -0.5, 0, 1, 0], [0, 0, 0, 0, 0, 1, 0]]},
            ["joint 3", "position", "published limit -0.0698"],
        ),
        (
            "franka",
            FRANKA
            | {"limits": FRANKA["limits"] | {"velocity": 2.3}}
            | {"waypoints": [[-1.5, 0, 0, -1, 0, 1, 0], [1.5, 0, 0, -1, 0, 1, 0]]},
            ["joint 0", "velocity", "2.3", "published limit 2.175"],
        ),
        ("franka", FRANKA | {"limits": {"velocity": 2, "acceleration": 7, "jerk": 9000}}, ["joint 1", "jerk", "3750"]),
    ],
)  # fmt: skip
def test_what_a_controller_would_not_take_is_refused(run, name, body, words):
    err = run(body, "--controller", name, "--out", "x.csv", code=2)
    assert all(word in err for word in words), err
    assert not Path("x.csv").exists()


def test_differences_are_checked_on_the_request_s_limits_too():
    from api.controllers import Unfit, _asked, _check_differences
    from planner import Limits

    q = np.zeros((6, 2))
    q[3:, 1] = 0.01
    loose = (np.full(2, -20.0), np.full(2, 20.0))
    _check_differences(q, 1, 0.001, loose, "the request's limit")
    with pytest.raises(Unfit, match="joint 1, sample 3: the velocity .* is 10, beyond the request's limit 5"):
        _check_differences(q, 1, 0.001, (-loose[1] / 4, loose[1] / 4), "the request's limit")
    with pytest.raises(Unfit, match="joint 1, sample [34]: the acceleration .*10000"):
        _check_differences(q, 2, 0.001, loose, "the request's limit")

    class Sampled:
        times = np.arange(6.0)
        dims = 1

    whole, slow = Limits.of({"velocity": 9}, 1), Limits.of({"velocity": 2}, 1)
    lower, upper = _asked(whole, [None, slow], [0.0, 2.0, 5.0], 1, Sampled, 1.0)
    assert upper[:, 0].tolist() == [9, 9, 9, 9, 2, 2, 2] and np.array_equal(lower, -upper)


def test_segment_limits_hold_for_the_controller(run):
    body = UR | {"method": "time_optimal_waypoints", "segment_limits": [{"velocity": 0.5}, None]}
    assert "as ur sees them" in run(body, "--controller", "ur")


def test_a_retiming_for_a_controller(run):
    body = {
        "trajectory": {"samples": {"time": [0, 1, 2], "position": UR["waypoints"]}},
        "limits": UR["limits"],
    }
    out = run(body, "--controller", "ur", "--out", "x.urscript", command="retime")
    assert "as ur sees them" in out and len(rows(Path("x.urscript").read_text())[0]) > 100


def test_sampling_is_said_once(run):
    sampled = UR | {"sampling": {"count": 20}}
    for argv in (("--dt", "0.01"), ("--controller", "ur")):
        assert "/sampling" in run(sampled, *argv, code=2)
    assert "every 0.001 s" in run(FRANKA, "--controller", "franka", "--dt", "0.002", code=2)
    assert "whole multiple" in run(UR, "--controller", "ur", "--dt", "0.003", code=2)
    for dt in ("0", "-1", "nan", "inf"):
        assert "must be > 0" in run(UR, f"--dt={dt}", code=2)
    assert "/include" in run(UR | {"include": ["polynomial"]}, "--controller", "ur", code=2)
    run(TIMED, "--dt", "0.5", "--out", "x.json")
    assert answer("x.json")["samples"]["time"] == [0, 0.5, 1, 1.5, 2]


def test_too_many_samples_say_which_dt_fits(run):
    err = run(TIMED, "--dt", "1e-9", code=2)
    assert "fits with a dt of" in err and '"include": ["polynomial"]' in err


def test_a_clock_too_coarse_for_a_period_is_refused(run):
    body = TIMED | {"times": [99e9, 99e9 + 1, 99e9 + 2]}
    assert "apart, not 0.002 s" in run(body, "--controller", "ur", code=2)


def test_the_controllers_table_is_whole():
    for controller in CONTROLLERS.values():
        assert controller.source.startswith("https://") and controller.source in PAGE
        for lower, upper in controller.limits.values():
            assert len(lower) == len(upper) == controller.joints
            assert all(low < high for low, high in zip(lower, upper, strict=True))
    assert list(CONTROLLERS["franka"].limits) == list(ORDERS)


def test_the_page_s_commands_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    files = re.findall(r"^`(\w+\.json)`:\n\n```json\n(.*?)```", PAGE, re.M | re.S)
    assert len(files) == 2
    for name, text in files:
        Path(name).write_text(text)
    commands = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.S) for line in block.splitlines()]
    assert len(commands) >= 8
    for command in commands:
        program, *argv = shlex.split(command)
        assert program == "waywright" and main(argv) == 0, capsys.readouterr().err
        assert Path(argv[-1]).stat().st_size > 1000


def test_importing_the_command_line_loads_no_large_library():
    import subprocess

    large = ("pyarrow", "plotly", "rosbags", "matplotlib")
    code = f"import sys, api.__main__; print([m for m in {large} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
