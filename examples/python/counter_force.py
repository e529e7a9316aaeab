"""How much flapping counter-force the wings of the multibody model make by themselves.

    python counter_force.py

The robot is welded and beats in a wind. What the air does to its wings, averaged over beats, against the speed of the wind, is the
force that holds a robot back which moves (Cheng, Deng 2011): its part in proportion to the speed, per mass, and what a line leaves.
"""

import numpy as np

import flappy

VEHICLE, HOVER_V, BEATS, WARM_UP = "vehicles/hummingbird_identified.toml", 9.8, 40, 20
SPEEDS = np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6])  # m/s


def mean_force(axis: str, speed: float, amplitude: float) -> float:
    """Mean force of the air on the wings along an axis of the body, N, in a wind along it."""
    wind = [f"effects.wind.{a}_m_s={speed if a == axis else 0.0}" for a in "xyz"]
    vehicle = flappy.Vehicle(VEHICLE, [*wind, "effects.wind.gust_m_s=0.0"])
    batch = flappy.Batch(1, vehicle)
    batch.reset(0, start="welded")
    batch.set_inputs([amplitude, 0, 0, 0])
    beat_s = 1 / vehicle["driver.flapping_Hz"]
    steps = [round(n * beat_s / 250e-6) for n in (WARM_UP, WARM_UP + BEATS)]
    batch.step(steps[0])
    before = batch.held_impulse()[0]
    batch.step(steps[1] - steps[0])
    return float((batch.held_impulse()[0] - before)["xyz".index(axis)] / ((steps[1] - steps[0]) * 250e-6))


vehicle = flappy.Vehicle(VEHICLE)
bodies = ["torso", *(f"{side}.{part}" for side in ("left", "right") for part in ("leading_edge", "wing"))]
mass_kg = sum(vehicle[f"{body}.mass_kg"] for body in bodies)
for amplitude in (0.8 * HOVER_V, HOVER_V, 1.2 * HOVER_V):
    print(f"amplitude {amplitude:.1f} V")
    for axis in "xyz":
        force = np.array([mean_force(axis, s, amplitude) for s in SPEEDS])
        cubic = np.polynomial.polynomial.polyfit(SPEEDS, force, 3)
        line = np.polynomial.polynomial.polyfit(SPEEDS, force, 1)
        left = np.abs(force - np.polynomial.polynomial.polyval(SPEEDS, line)).max()
        print(
            f"  {axis}: {cubic[1] / mass_kg:6.2f} 1/s at rest, {line[1] / mass_kg:6.2f} to {SPEEDS[-1]} m/s; a line is off by "
            f"{left / np.abs(force - force[len(SPEEDS) // 2]).max():.0%} at most"
        )
