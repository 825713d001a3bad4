# SPDX-License-Identifier: MIT
"""Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.

    plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
    task      x1 follows r(t), and every signal stays bounded
    notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
              phi: regressor;  theta: unknown parameter (1/s);  theta_hat: estimate of theta;
              x_dot: time derivative of x;
              x_dot_known: x_dot with theta_hat in the place of theta, as if constant;
              alpha1_x1: partial derivative of alpha1 with respect to x1
    (n)       section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1

    install   python3 -m pip install numpy scipy matplotlib
    run       python3 Chapter17_Lesson1.py
"""

import csv
import os
import sys
from typing import TypeVar

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Log = NDArray[np.float64]  # one value for each logged time
Signal = TypeVar("Signal", float, Log)

# ---- Parameters ----

THETA_TRUE = 1.2  # (15) true parameter, unknown to the controller, 1/s
K1 = 2.0  # (15) gain on z1, positive
K2 = 2.5  # (15) gain on z2, positive
GAMMA = 3.0  # (15) adaptation gain, positive
AMPLITUDE = 0.5  # (15) of the reference
OMEGA = 0.7  # (15) of the reference, rad/s
X1_START = 1.2  # (15) x1 at t = 0
X2_START = -0.5  # (15) x2 at t = 0
THETA_HAT_START = 0.0  # (15) theta_hat at t = 0
FINAL_TIME = 20.0  # (15) horizon, s
INTERVALS = 4000  # logged, of equal length
REL_TOL = 1e-9  # of RK45
ABS_TOL = 1e-11  # of RK45
MAX_STEP = 0.02  # of RK45, s

CSV_NAME = "Chapter17_Lesson1_python.csv"
TRACKING_NAME = "Chapter17_Lesson1_python_tracking.png"
ERROR_NAME = "Chapter17_Lesson1_python_error.png"
ESTIMATE_NAME = "Chapter17_Lesson1_python_estimate.png"

# ---- Reference ----


def reference(t: Signal) -> tuple[Signal, Signal, Signal]:
    """Return r, r' and r'' at the time t."""
    r = AMPLITUDE * np.sin(OMEGA * t)  # (15) reference
    r_dot = AMPLITUDE * OMEGA * np.cos(OMEGA * t)  # (15) its first derivative
    r_ddot = -AMPLITUDE * OMEGA * OMEGA * np.sin(OMEGA * t)  # (15) its second derivative
    return r, r_dot, r_ddot


# ---- Controller ----


def regressor(x1: float) -> float:
    """Return phi, which theta multiplies in row 1 of the plant."""
    phi = x1  # (4) regressor
    return phi


def controller(t: float, x1: float, x2: float, theta_hat: float) -> tuple[float, float]:
    """Return u and theta_hat'. It sees the state and the estimate of theta, and no more."""
    r, r_dot, r_ddot = reference(t)
    phi = regressor(x1)
    z1 = x1 - r  # (5) tracking error
    alpha1 = -K1 * z1 - theta_hat * phi + r_dot  # (7) virtual control
    z2 = x2 - alpha1  # (5) deviation from the virtual control
    # phi(x1) = x1 has the derivative 1
    alpha1_x1 = -K1 - theta_hat  # (7) partial derivative of alpha1 by x1
    tau2 = phi * z1 - alpha1_x1 * phi * z2  # (7) tuning function
    theta_hat_dot = GAMMA * tau2  # (7) update law
    # alpha1' with theta_hat in the place of theta, as if constant
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * phi) + K1 * r_dot + r_ddot  # (7) known part
    # alpha1 moves with theta_hat too: hence the last term
    u = alpha1_dot_known - z1 - K2 * z2 - phi * theta_hat_dot  # (7) control
    return u, theta_hat_dot


# ---- Closed loop ----


def closed_loop(t: float, state: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the derivative of the state (x1, x2, theta_hat)."""
    x1, x2, theta_hat = state
    u, theta_hat_dot = controller(t, x1, x2, theta_hat)
    phi = regressor(x1)
    x1_dot = x2 + THETA_TRUE * phi  # (7) plant, row 1
    x2_dot = u  # (7) plant, row 2
    return x1_dot, x2_dot, theta_hat_dot


# ---- Integrate ----


def simulate() -> tuple[Log, Log, Log, Log]:
    """Return t, x1, x2 and theta_hat at the logged times; raise RuntimeError where the integration fails."""
    initial_state = (X1_START, X2_START, THETA_HAT_START)
    t_eval = np.linspace(0.0, FINAL_TIME, INTERVALS + 1)
    with np.errstate(over="ignore", invalid="ignore"):  # a failed integration is reported below
        solution = solve_ivp(
            closed_loop,
            (0.0, FINAL_TIME),
            initial_state,
            method="RK45",
            t_eval=t_eval,
            rtol=REL_TOL,
            atol=ABS_TOL,
            max_step=MAX_STEP,
        )
    if not solution.success:
        raise RuntimeError(f"integration failed: {solution.message}")
    x1, x2, theta_hat = solution.y
    return solution.t, x1, x2, theta_hat


# ---- Write CSV ----


def write_csv(t: Log, x1: Log, x2: Log, theta_hat: Log, r: Log, tracking_error: Log) -> None:
    """Write one row for each logged time; raise OSError where that cannot be done."""
    # renamed when complete, so that no half-written CSV looks whole
    part = CSV_NAME + ".part"
    try:
        with open(part, "w", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(["t", "x1", "x2", "theta_hat", "reference", "tracking_error"])
            rows.writerows(np.column_stack([t, x1, x2, theta_hat, r, tracking_error]).tolist())
        os.replace(part, CSV_NAME)
    except OSError as error:
        raise OSError(error.errno, error.strerror, CSV_NAME) from error


# ---- Report ----


def report(theta_hat: Log, tracking_error: Log) -> None:
    """Print the last tracking error and estimate, the true parameter, and the name of the CSV."""
    print(f"Final tracking error: {tracking_error[-1]:.6e}")
    print(f"Final parameter estimate: {theta_hat[-1]:.10f}")
    print(f"True parameter: {THETA_TRUE:.10f}")
    print(f"Data written to {CSV_NAME}", flush=True)


# ---- Figures ----


def draw(t: Log, x1: Log, theta_hat: Log, r: Log, tracking_error: Log) -> None:
    """Show the three figures in windows or, headless, write them as PNG files."""
    tracking_figure, axes = plt.subplots()
    axes.plot(t, x1, label="$x_1$")
    axes.plot(t, r, "--", label="$r$")
    axes.set(title="Adaptive-Backstepping Tracking", xlabel="time (s)", ylabel="output y")
    axes.legend(loc="upper right")
    axes.grid()

    error_figure, axes = plt.subplots()
    axes.plot(t, tracking_error, label="$z_1 = x_1 - r$")
    axes.set(title="Tracking Error", xlabel="time (s)", ylabel="tracking error $z_1$")
    axes.legend(loc="upper right")
    axes.grid()

    estimate_figure, axes = plt.subplots()
    axes.plot(t, theta_hat, label=r"$\hat{\theta}$")
    axes.axhline(THETA_TRUE, color="C1", linestyle="--", label=r"$\theta$")
    axes.set(title="Parameter Estimate", xlabel="time (s)", ylabel="parameter (1/s)")
    axes.legend(loc="upper right")
    axes.grid()

    if sys.stdout.isatty() and plt.get_backend() != "agg":
        plt.show()
    else:
        tracking_figure.savefig(TRACKING_NAME)
        error_figure.savefig(ERROR_NAME)
        estimate_figure.savefig(ESTIMATE_NAME)


def main() -> None:
    """Simulate, write the CSV, report, and draw."""
    t, x1, x2, theta_hat = simulate()
    r, _, _ = reference(t)
    tracking_error = x1 - r
    write_csv(t, x1, x2, theta_hat, r, tracking_error)
    report(theta_hat, tracking_error)
    draw(t, x1, theta_hat, r, tracking_error)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        sys.exit(f"Chapter17_Lesson1: cannot write {error.filename or 'to standard output'}: {error.strerror}")
    except RuntimeError as error:
        sys.exit(f"Chapter17_Lesson1: {error}")
