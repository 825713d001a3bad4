# SPDX-License-Identifier: MIT
"""Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.

    plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
    task      x1 follows r(t), and every signal stays bounded
    notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
              theta_hat: estimate of theta;  x_dot: time derivative of x;
              alpha1_x1: partial derivative of alpha1 with respect to x1
    (n)       section n of the lesson
"""

import csv
import os
import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

# ---- Parameters ----

theta = 1.2  # (10) true parameter, used by the plant alone
k1 = 2.0  # (10) gain on z1, positive
k2 = 2.5  # (10) gain on z2, positive
gamma = 3.0  # (10) adaptation gain, positive
amplitude = 0.5  # (10) of the reference
omega = 0.7  # (10) of the reference, rad/s
x1_start = 1.2  # (10) x1 at t = 0
x2_start = -0.5  # (10) x2 at t = 0
theta_hat_start = 0.0  # (10) theta_hat at t = 0
t_final = 20.0  # (10) horizon, s
intervals = 4000  # logged, of equal length
rel_tol = 1e-9  # of RK45
abs_tol = 1e-11  # of RK45
max_step = 0.02  # of RK45, s

csv_name = "Chapter17_Lesson1_python.csv"
png_name = "Chapter17_Lesson1_python.png"

# ---- Reference ----


def reference(t):
    r = amplitude * np.sin(omega * t)  # (10) reference
    r_dot = amplitude * omega * np.cos(omega * t)  # (10) its first derivative
    r_ddot = -amplitude * omega * omega * np.sin(omega * t)  # (10) its second derivative
    return r, r_dot, r_ddot


# ---- Controller ----


def controller(t, x1, x2, theta_hat):
    r, r_dot, r_ddot = reference(t)
    z1 = x1 - r  # (5) tracking error
    alpha1 = -k1 * z1 - theta_hat * x1 + r_dot  # (7) virtual control
    z2 = x2 - alpha1  # (5) distance from the virtual control
    alpha1_x1 = -k1 - theta_hat  # (7) partial derivative of alpha1
    tau2 = x1 * z1 - alpha1_x1 * x1 * z2  # (7) tuning function
    theta_hat_dot = gamma * tau2  # (7) update law
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot  # (7) known part of alpha1'
    u = alpha1_dot_known - z1 - k2 * z2 - x1 * theta_hat_dot  # (7) control
    return u, theta_hat_dot


# ---- Closed loop ----


def closed_loop(t, state):
    x1, x2, theta_hat = state
    u, theta_hat_dot = controller(t, x1, x2, theta_hat)
    x1_dot = x2 + theta * x1  # (7) plant, row 1
    x2_dot = u  # (7) plant, row 2
    return x1_dot, x2_dot, theta_hat_dot


# ---- Integrate ----


def simulate():
    with np.errstate(over="ignore", invalid="ignore"):  # a failed integration is reported below
        solution = solve_ivp(
            closed_loop,
            (0.0, t_final),
            (x1_start, x2_start, theta_hat_start),
            method="RK45",
            t_eval=np.linspace(0.0, t_final, intervals + 1),
            rtol=rel_tol,
            atol=abs_tol,
            max_step=max_step,
        )
    if not solution.success:
        raise RuntimeError(f"integration failed: {solution.message}")
    return solution.t, *solution.y


# ---- Write CSV ----


def write_csv(t, x1, x2, theta_hat):
    r, _, _ = reference(t)
    part = csv_name + ".part"  # renamed when complete, so that no half-written CSV looks whole
    with open(part, "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["t", "x1", "x2", "theta_hat", "reference", "tracking_error"])
        rows.writerows(np.column_stack([t, x1, x2, theta_hat, r, x1 - r]).tolist())
    os.replace(part, csv_name)


# ---- Report ----


def report(t, x1, theta_hat):
    r, _, _ = reference(t)
    print(f"Final tracking error: {x1[-1] - r[-1]:.6e}")
    print(f"Final parameter estimate: {theta_hat[-1]:.10f}")
    print(f"True parameter: {theta:.10f}")
    print(f"Data written to {csv_name}")


# ---- Figures ----


def draw(t, x1, theta_hat):
    r, _, _ = reference(t)
    windows = sys.stdout.isatty() and plt.get_backend() != "agg"  # headless, the figure becomes a PNG file
    figure, (tracking, error, estimate) = plt.subplots(3, 1, sharex=True, layout="constrained")
    tracking.plot(t, x1, "-", label="$x_1$")
    tracking.plot(t, r, "--", label="$r$")
    tracking.set_ylabel("output y")
    error.plot(t, x1 - r, "-", label="$z_1$")
    error.set_ylabel("tracking error $z_1$")
    estimate.plot(t, theta_hat, "-", label=r"estimate of $\theta$")
    estimate.plot(t, np.full_like(t, theta), "--", label=r"$\theta$")
    estimate.set_ylabel("parameter, 1/s")
    estimate.set_xlabel("time (s)")
    for axes in (tracking, error, estimate):
        axes.legend()
    if windows:
        plt.show()
    else:
        figure.savefig(png_name)


def main():
    t, x1, x2, theta_hat = simulate()
    write_csv(t, x1, x2, theta_hat)
    report(t, x1, theta_hat)
    draw(t, x1, theta_hat)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        sys.exit(f"Chapter17_Lesson1: cannot write {error.filename or csv_name}: {error.strerror}")
    except RuntimeError as error:
        sys.exit(f"Chapter17_Lesson1: {error}")
