#!/usr/bin/env python3
"""An external estimator in Python: where the frames were taken by the IMU alone, from the prior's state on.

    dead_reckoning.py --dataset DIR --out DIR
    t_imu = t_cam + td    with the prior's td (of the middle row); poses are written in the camera's clock
"""
import argparse
import json
import math
import pathlib


def read_yaml(path):
    """A dataset's YAML is maps by indentation, and values that are JSON."""
    maps = {0: {}}
    for line in path.read_text().splitlines():
        key, value = line.split(":", 1)
        indent = len(key) - len(key.lstrip())
        maps[indent][key.strip()] = json.loads(value) if value.strip() else {}
        maps[indent + 2] = maps[indent][key.strip()]
    return maps[0]


def read_csv(path):
    rows = [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]
    return [(int(row[0]), [float(x) for x in row[1:]]) for row in rows]


def multiply(a, b):  # Hamilton, x y z w
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def rotate(q, v):
    return multiply(multiply(q, [*v, 0.0]), [-q[0], -q[1], -q[2], q[3]])[:3]


def exponential(w):
    angle = math.sqrt(sum(x * x for x in w))
    s = math.sin(angle / 2) / angle if angle > 1e-9 else 0.5
    return [s * x for x in w] + [math.cos(angle / 2)]


def step(state, a, b, dt, bias, gravity):
    """From the sample a to b, dt seconds later, the readings linear between them."""
    q, p, v = state
    rate = [(x + y) / 2 - o for x, y, o in zip(a[:3], b[:3], bias[:3])]
    q1 = multiply(q, exponential([dt * x for x in rate]))
    force = [rotate(r, [x - o for x, o in zip(s[3:], bias[3:])]) for r, s in ((q, a), (q1, b))]
    acceleration = [(x + y) / 2 - g for x, y, g in zip(*force, (0.0, 0.0, gravity))]
    p1 = [x + dt * (u + dt / 2 * f) for x, u, f in zip(p, v, acceleration)]
    return q1, p1, [u + dt * f for u, f in zip(v, acceleration)]


parser = argparse.ArgumentParser()
parser.add_argument("--dataset", type=pathlib.Path, required=True)
parser.add_argument("--out", type=pathlib.Path, required=True)
args = parser.parse_args()
gravity = read_yaml(args.dataset / "meta.yaml")["gravity_m_s2"]
prior = read_yaml(args.dataset / "prior.yaml")
imu = [s for s in read_csv(args.dataset / "mav0/imu0/data.csv") if s[0] >= prior["t_ns"]]
mean, td_s = prior["mean"], prior["calibration"]["td_s"]
bias = mean["gyro_bias_rad_s"] + mean["accel_bias_m_s2"]
state = (mean["T_W_B"]["quaternion_xyzw"], mean["T_W_B"]["position_m"], mean["velocity_m_s"])
frames = [t for t, _ in read_csv(args.dataset / "mav0/cam0/data.csv")]
with open(args.out / "estimate.tum", "w") as out:
    for (t0, a), (t1, b) in zip(imu, imu[1:]):
        for t_cam in frames:
            t = t_cam + round(td_s * 1e9)
            if t0 <= t < t1:
                s = (t - t0) / (t1 - t0)
                at = step(state, a, [x + s * (y - x) for x, y in zip(a, b)], (t - t0) * 1e-9, bias, gravity)
                out.write(f"{t_cam // 10**9}.{t_cam % 10**9:09d} " + " ".join(f"{x!r}" for x in at[1] + at[0]) + "\n")
        state = step(state, a, b, (t1 - t0) * 1e-9, bias, gravity)
(args.out / "meta.yaml").write_text(f"stamp_clock: camera\ntd_s: {td_s!r}\ntd_reference_row: middle\n")
