"""Levitates a mass of its own with the `ems` unit and plots the gap.

    python levitate_mass.py target/fmu/ems.fmu gap.png        (needs fmpy and matplotlib)

The mass hangs half a millimetre too low; the magnet pulls it up to the nominal gap of 8 mm.
"""

import shutil
import sys

import matplotlib
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

matplotlib.use("Agg")
import matplotlib.pyplot as plt

MASS, GRAVITY, STEP, END = 250.0, 9.81, 1e-4, 2.5

unit, picture = sys.argv[1:3]
description, folder = read_model_description(unit), extract(unit)
reference = {v.name: v.valueReference for v in description.modelVariables}
inputs = [reference[name] for name in ("gap", "gap_rate", "acceleration", "static_force")]

magnet = FMU2Slave(guid=description.guid, unzipDirectory=folder, instanceName="magnet",
                   modelIdentifier=description.coSimulation.modelIdentifier)
magnet.instantiate()
magnet.setupExperiment(startTime=0.0)
magnet.enterInitializationMode()
gap, rate, acceleration = 0.0085, 0.0, 0.0  # downward is positive, as it opens the gap
magnet.setReal(inputs, [gap, rate, acceleration, MASS * GRAVITY])
magnet.exitInitializationMode()

times, gaps = [0.0], [gap]
for n in range(round(END / STEP)):
    magnet.doStep(n * STEP, STEP)
    acceleration = GRAVITY - magnet.getReal([reference["force"]])[0] / MASS
    rate += STEP * acceleration
    gap += STEP * rate
    magnet.setReal(inputs[:3], [gap, rate, acceleration])
    times.append((n + 1) * STEP)
    gaps.append(gap)
magnet.terminate()
magnet.freeInstance()
shutil.rmtree(folder)

plt.plot(times, [1e3 * gap for gap in gaps])
plt.xlabel("time (s)"), plt.ylabel("gap (mm)"), plt.grid()
plt.title(f"{MASS:.0f} kg under one magnet")
plt.savefig(picture)
print(f"settled gap: {1e3 * gaps[-1]:.3f} mm")
sys.exit(abs(gaps[-1] - 0.008) > 1e-5)
