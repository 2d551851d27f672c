"""The vehicle in Exudyn: built from the same file, shaken in the same way, compared and timed.

    cargo build --release -p multibody --example shaken
    python tests/python/exudyn_vehicle.py [VEHICLE.json] [--duration S]

Prints how far both are from our run in fine steps, and the time that either takes, for several step
sizes. docs/exudyn.md explains the model and what the numbers mean.
"""

import argparse
import ctypes
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np



def without_graphics():
    """Lets Exudyn load where there are no graphics: it is linked to them, but only windows use them."""
    try:
        for library in ["libX11.so.6", "libGL.so.1"]:
            ctypes.CDLL(library)
    except OSError:
        package = Path(importlib.util.find_spec("exudyn").origin).parent
        windows = [p.name for p in package.with_name("exudyn.libs").glob("libglfw*")]
        with tempfile.TemporaryDirectory() as folder:
            for name in [*windows, "libGL.so.1"]:
                empty = Path(folder) / name
                options = ["-shared", f"-Wl,-soname,{name}", "-x", "c", os.devnull, "-o", empty]
                subprocess.run(["gcc", *options], check=True)
                ctypes.CDLL(str(empty), mode=ctypes.RTLD_GLOBAL)
        # what is never called is never looked up
        sys.setdlopenflags(os.RTLD_LAZY)


without_graphics()
sys.exudynFast = True  # the build without range checks
import exudyn as exu
from exudyn import itemInterface as items
from exudyn.advancedUtilities import CreateSymbolicUserFunction

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
VEHICLES = ROOT / "fmu-vehicle" / "resources"

CASE = {
    "duration": 1.0,
    "step": 1e-3,
    "interval": 0.01,
    # what a magnet's control amounts to for slow motion
    "stiffness": 7e5,
    "damping": 8e3,
    "fade": 0.3,
    # phases over 24 m x 2 m: bounce, pitch, yaw, roll and the side frames' own motions all take part
    "waves": [
        {"amplitude": 2e-3, "frequency": 1.1, "along": 0.25, "across": 0.5},
        {"amplitude": 5e-4, "frequency": 3.7, "along": -0.9, "across": 1.3},
        {"amplitude": 1e-4, "frequency": 9.0, "along": 2.1, "across": -0.7},
    ],
}

# Length of the rods that stand for springs along an axis fixed to a body, m; see `rod`.
ROD = 1e5


# ---- ours -----------------------------------------------------------------------------------------


def ours(vehicle, case):
    """Runs the library's example on the case."""
    program = TARGET / "release" / "examples" / "shaken"
    text = json.dumps(case)
    done = subprocess.run([program, vehicle], input=text, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{program}: {done.stderr}")
    return json.loads(done.stdout)


def poses(rows):
    """Rows of our bodies as arrays: positions (row, body, 3) and quaternions (row, body, 4)."""
    return (
        np.array([[b["position"] for b in row] for row in rows]),
        np.array([[b["attitude"] for b in row] for row in rows]),
    )


# ---- Exudyn's -------------------------------------------------------------------------------------


def rotation(q):
    """Rotation matrix of a quaternion (w, x, y, z)."""
    w, x, y, z = np.asarray(q, float) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def frame(axis, column):
    """A rotation whose given column is the axis."""
    n = np.asarray(axis, float) / np.linalg.norm(axis)
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    u /= np.linalg.norm(u)
    cyclic = [n, u, np.cross(n, u)]
    return np.array([cyclic[(k - column) % 3] for k in range(3)]).T


class Vehicle:
    """The Exudyn model of a vehicle file."""

    def __init__(self, description, case, loads, intrinsic=True):
        self.description = description
        # rotation vectors as ours; else Exudyn's default of three successive angles, which is faster
        self.intrinsic = intrinsic
        self.system = exu.SystemContainer()
        self.mbs = self.system.AddSystem()
        self.recorded = []
        self.ground = self.mbs.AddObject(items.ObjectGround())
        self.merge()
        self.bodies = {}  # first name of the group: (object, node, centre, attitude)
        self.place = {}  # name of a described body: first name of its group, None for the ground
        for name, group in self.groups.items():
            for member in group:
                self.place[member["name"]] = name
            if name is not None:
                self.add_body(name, group)
        for joint in description["joints"]:
            self.add_joint(joint)
        for bushing in description["bushings"]:
            self.add_bushing(bushing)
        for force in description.get("joint_forces", []):
            self.add_joint_force(force)
        assert not description.get("springs"), "line springs are not needed so far"
        if drive := description.get("drive"):
            for body in drive["bodies"]:
                at = next(b["position"] for b in description["bodies"] if b["name"] == body)
                self.rod("ground", body, at, [1, 0, 0], drive["stiffness"], drive["damping"], 0.0)
        for magnet, load in zip(description["magnets"], loads):
            self.add_magnet(magnet, load, case)
        self.mbs.Assemble()

    def merge(self):
        """Groups of bodies that brackets tie together; the ground's has no name."""
        bodies = {b["name"]: b for b in self.description["bodies"]}
        group = {name: name for name in bodies}
        group["ground"] = None
        for joint in self.description["joints"]:
            if joint["kind"] == "bracket":
                a, b = group[joint["body_a"]], group[joint["body_b"]]
                kept, lost = (a, b) if b is not None else (b, a)
                group = {n: kept if g == lost else g for n, g in group.items()}
        self.groups = {}
        for name, body in bodies.items():
            self.groups.setdefault(group[name], []).append(body)
        # named by the first member in the file, as ours are
        self.groups = {
            None if key is None else members[0]["name"]: members
            for key, members in self.groups.items()
        }

    def add_body(self, name, group):
        mass = sum(b["mass"] for b in group)
        centre = sum(b["mass"] * np.array(b["position"]) for b in group) / mass
        attitude = group[0].get("orientation") or [1, 0, 0, 0]
        turn = rotation(attitude)
        inertia = np.zeros((3, 3))
        for body in group:
            own = np.array(body["inertia"], float)
            own = np.diag(own) if own.ndim == 1 else own
            relative = turn.T @ rotation(body.get("orientation") or [1, 0, 0, 0])
            arm = turn.T @ (np.array(body["position"]) - centre)
            inertia += relative @ own @ relative.T
            inertia += body["mass"] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        node = self.mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=[*centre, *attitude]))
        j = inertia
        number = self.mbs.AddObject(
            items.ObjectRigidBody(
                mass=mass,
                inertia=[j[0, 0], j[1, 1], j[2, 2], j[1, 2], j[0, 2], j[0, 1]],
                nodeNumber=node,
            )
        )
        self.bodies[name] = (number, node, centre, turn)
        weight = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=number))
        gravity = self.description["gravity"]
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=weight, loadVector=gravity))

    def marker(self, body, point, axes=None):
        """A marker at a world point of the initial pose, its axes given in the world."""
        name = None if body == "ground" else self.place[body]
        number, _, centre, turn = (
            (self.ground, None, np.zeros(3), np.eye(3)) if name is None else self.bodies[name]
        )
        local = turn.T @ (np.array(point, float) - centre)
        pose = np.eye(4)
        pose[:3, 3] = local
        pose[:3, :3] = turn.T @ (np.eye(3) if axes is None else axes)
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localHT=pose))

    def add_joint(self, joint):
        kind = joint["kind"]
        if kind == "bracket":
            return
        ends = [joint["body_a"], joint["body_b"]]
        column = {"spherical": None, "translational": 0, "revolute": 2}[kind]
        axes = None if column is None else frame(joint["axis"], column)
        markers = [self.marker(body, joint["position"], axes) for body in ends]
        new = {
            "spherical": items.ObjectJointSpherical,
            "translational": items.ObjectJointPrismaticX,
            "revolute": items.ObjectJointRevoluteZ,
        }[kind]
        self.mbs.AddObject(new(markerNumbers=markers))

    def rod(self, body_a, body_b, point, axis, stiffness, damping, preload):
        """A spring-damper on b's point along an axis that is fixed to a.

        Built as a line spring to a point on a that lies `ROD` away along the axis: its line always
        runs through b's point, so it balances exactly on both bodies, and for a long rod its
        direction and its length are those along the axis, but for terms of d/ROD and d²/(2 ROD)
        in the displacement d across.
        """
        n = np.asarray(axis, float) / np.linalg.norm(axis)
        far = np.array(point, float) - ROD * n
        self.mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[self.marker(body_a, far), self.marker(body_b, point)],
                referenceLength=ROD,
                stiffness=stiffness,
                damping=damping,
                force=preload,
            )
        )

    def add_bushing(self, bushing):
        zero = [0.0] * 3
        ends = [bushing["body_a"], bushing["body_b"]]
        axes = rotation(bushing.get("orientation") or [1, 0, 0, 0])
        for k in range(3):
            along = [
                bushing.get(key, zero)[k]
                for key in ("translational_stiffness", "translational_damping", "preload")
            ]
            if any(along):
                self.rod(*ends, bushing["position"], axes[:, k], *along)
        about = [bushing.get(key, zero) for key in ("rotational_stiffness", "rotational_damping")]
        if np.any(about):
            # no forces, so nothing of this element is out of balance
            stiffness, damping = (np.diag([0.0] * 3 + values) for values in about)
            self.mbs.AddObject(
                items.ObjectConnectorRigidBodySpringDamper(
                    markerNumbers=[self.marker(b, bushing["position"], axes) for b in ends],
                    stiffness=stiffness,
                    damping=damping,
                    useIntrinsicFormulation=self.intrinsic,
                )
            )

    def add_joint_force(self, force):
        joint = next(j for j in self.description["joints"] if j["name"] == force["joint"])
        ends = [joint["body_a"], joint["body_b"]]
        damping = force.get("damping", 0.0)
        if joint["kind"] == "translational":
            pull = -force.get("preload", 0.0)
            self.rod(*ends, joint["position"], joint["axis"], force["stiffness"], damping, pull)
            return
        assert not force.get("preload"), "hinges with a constant moment are not needed so far"
        axes = frame(joint["axis"], 2)
        self.mbs.AddObject(
            items.ObjectConnectorTorsionalSpringDamper(
                markerNumbers=[self.marker(b, joint["position"], axes) for b in ends],
                stiffness=force["stiffness"],
                damping=damping,
            )
        )

    def add_magnet(self, magnet, load, case):
        """A vertical spring to the unmoved track; what the track moves is a load."""
        at, k, c = magnet["position"], case["stiffness"], case["damping"]
        here = self.marker(magnet["body"], at)
        self.mbs.AddObject(
            items.ObjectConnectorCartesianSpringDamper(
                markerNumbers=[self.marker("ground", at), here],
                stiffness=[0, 0, k],
                damping=[0, 0, c],
            )
        )
        sin, cos = exu.symbolic.sin, exu.symbolic.cos
        fade2 = case["fade"] ** 2
        waves = [
            (w["amplitude"], 2 * math.pi * w["frequency"], w["along"] * at[0] + w["across"] * at[1])
            for w in case["waves"]
        ]

        def force(mbs, t, load_vector):
            wave = sum(a * sin(o * t - p) for a, o, p in waves)
            rate = sum(a * o * cos(o * t - p) for a, o, p in waves)
            fade = t * t / (t * t + fade2)
            fading = 2 * t * fade2 / ((t * t + fade2) * (t * t + fade2))
            height_rate = fading * wave + fade * rate
            return [0, 0, load + k * fade * wave + c * height_rate]

        item = self.mbs.AddLoad(items.LoadForceVector(markerNumber=here))
        # recorded once, evaluated without Python
        recorded = CreateSymbolicUserFunction(
            self.mbs, force, "loadVectorUserFunction", itemIndex=item
        )
        self.mbs.SetLoadParameter(item, "loadVectorUserFunction", recorded)
        self.recorded.append(recorded)  # or it is freed

    def begin(self, names, start):
        """Sets the initial pose, given for the bodies in the order of the names."""
        for name, pose in zip(names, start):
            node = self.bodies[name][1]
            reference = np.array(self.mbs.GetNode(node)["referenceCoordinates"])
            target = np.array([*pose["position"], *pose["attitude"]])
            self.mbs.SetNodeParameter(node, "initialCoordinates", list(target - reference))
        self.mbs.Assemble()

    def run(self, names, case, step, tolerance):
        """Generalised-alpha; returns positions, quaternions (row, body, …), processor's seconds."""
        sensors = [
            self.mbs.AddSensor(
                items.SensorNode(
                    nodeNumber=self.bodies[name][1],
                    storeInternal=True,
                    writeToFile=False,
                    outputVariableType=exu.OutputVariableType.Coordinates,
                )
            )
            for name in names
        ]
        self.mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(case["duration"] / step)
        settings.timeIntegration.endTime = case["duration"]
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.newton.relativeTolerance = tolerance
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = case["interval"]
        settings.timeIntegration.verboseMode = 0
        settings.parallel.numberOfThreads = 1
        begin = time.process_time()
        self.mbs.SolveDynamic(settings)
        seconds = time.process_time() - begin
        columns = np.array([self.mbs.GetSensorStoredData(s)[:, 1:8] for s in sensors])
        reference = np.array(
            [self.mbs.GetNode(self.bodies[n][1])["referenceCoordinates"] for n in names]
        )
        coordinates = columns.transpose(1, 0, 2) + reference
        return coordinates[..., :3], coordinates[..., 3:7], seconds


def angles(p, q):
    """Rotation vectors (for small angles) between two arrays of quaternions, to either sign."""
    p, q = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (p, q))
    w, v, a, b = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    vector = w * b - a * v - np.cross(v, b)
    return 2 * vector * np.sign(w * a + np.sum(v * b, axis=-1, keepdims=True))


def rms(x):
    return math.sqrt(np.mean(np.square(x)))


def compare(reference, positions, attitudes):
    """RMS differences of places (m) and attitudes (rad), and each relative to the RMS motion."""
    r, q = poses(reference["rows"])
    moved, turned = rms(r - r[0]), rms(angles(q[:1], q))
    apart, askew = rms(positions - r), rms(angles(q, attitudes))
    return {"m": apart, "rad": askew, "places": apart / moved, "attitudes": askew / turned}


def theirs(vehicle, case, reference, step, intrinsic=True, tolerance=1e-8):
    """Runs Exudyn from our equilibrium; returns how far it is from the reference, and seconds."""
    description = json.loads(Path(vehicle).read_text())
    model = Vehicle(description, case, reference["loads"], intrinsic)
    model.begin(reference["bodies"], reference["equilibrium"])
    *coordinates, seconds = model.run(reference["bodies"], case, step, tolerance)
    return compare(reference, *coordinates), seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("vehicle", nargs="?", default=VEHICLES / "two-car" / "vehicle.json")
    parser.add_argument("--duration", type=float, default=CASE["duration"])
    options = parser.parse_args()
    case = {**CASE, "duration": options.duration}
    reference = ours(options.vehicle, {**case, "step": 1.25e-4})

    def show(what, step, once):
        """Differences of one run, and the shortest time of three."""
        apart, seconds = min((once(step) for _ in range(3)), key=lambda found: found[1])
        print(
            f"{what:24} {step * 1e3:6.3f} ms {seconds / case['duration']:8.3f} s per simulated s, "
            f"off by {apart['places']:.1e} of the motion ({apart['m']:.1e} m), "
            f"{apart['attitudes']:.1e} of the rotation ({apart['rad']:.1e} rad)"
        )

    print(f"Exudyn {exu.config.Version()}, against multibody in steps of 0.125 ms; all values RMS")
    def own(step):
        run = ours(options.vehicle, {**case, "step": step})
        return compare(reference, *poses(run["rows"])), run["seconds"]

    def exact(step):
        return theirs(options.vehicle, case, reference, step)

    def fastest(step):
        return theirs(options.vehicle, case, reference, step, intrinsic=False, tolerance=1e-6)

    for step in [5e-3, 2.5e-3, 2e-3, 1e-3, 5e-4]:
        show("multibody", step, own)
    for step in [5e-3, 2e-3, 1e-3]:
        show("Exudyn, fastest setting", step, fastest)
    for step in [2e-3, 1e-3, 5e-4, 2.5e-4]:
        show("Exudyn", step, exact)


if __name__ == "__main__":
    main()
