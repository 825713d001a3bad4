// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant; the playground's program.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               thetaHat: estimate of theta;  xDot: time derivative of x;
//               alpha1X1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson

// ---- Parameters ----

const h = 0.002;  // step of RK4, and interval between logged times, s

// (10) the sliders' values; omega in rad/s, tFinal in s
function program({ theta, k1, k2, gamma, amplitude, omega, x1Start, x2Start, thetaHatStart, tFinal }) {

  // ---- Reference ----

  function reference(t) {
    const r = amplitude * Math.sin(omega * t);                       // (10) reference
    const rDot = amplitude * omega * Math.cos(omega * t);            // (10) its first derivative
    const rDdot = -amplitude * omega * omega * Math.sin(omega * t);  // (10) its second derivative
    return { r, rDot, rDdot };
  }

  // ---- Controller ----

  function controller(t, x1, x2, thetaHat) {
    const { r, rDot, rDdot } = reference(t);
    const z1 = x1 - r;                               // (5) tracking error
    const alpha1 = -k1 * z1 - thetaHat * x1 + rDot;  // (7) virtual control
    const z2 = x2 - alpha1;                          // (5) distance from the virtual control
    const alpha1X1 = -k1 - thetaHat;                 // (7) partial derivative of alpha1
    const tau2 = x1 * z1 - alpha1X1 * x1 * z2;       // (7) tuning function
    const thetaHatDot = gamma * tau2;                // (7) update law
    const alpha1DotKnown = alpha1X1 * (x2 + thetaHat * x1) + k1 * rDot + rDdot;  // (7) known part of alpha1'
    const u = alpha1DotKnown - z1 - k2 * z2 - x1 * thetaHatDot;  // (7) control
    return { u, thetaHatDot, z1, z2 };
  }

  // ---- Closed loop ----

  function closedLoop(t, state) {
    const x1 = state[0];
    const x2 = state[1];
    const thetaHat = state[2];
    const { u, thetaHatDot } = controller(t, x1, x2, thetaHat);
    const x1Dot = x2 + theta * x1;  // (7) plant, row 1
    const x2Dot = u;                // (7) plant, row 2
    return [x1Dot, x2Dot, thetaHatDot];
  }

  // ---- Integrate ----

  function along(state, step, slope) {
    return [state[0] + step * slope[0], state[1] + step * slope[1], state[2] + step * slope[2]];
  }

  // slopes at the start, twice at the middle, and at the end of the step
  function rk4Step(t, state) {
    const s1 = closedLoop(t, state);
    const s2 = closedLoop(t + h / 2, along(state, h / 2, s1));
    const s3 = closedLoop(t + h / 2, along(state, h / 2, s2));
    const s4 = closedLoop(t + h, along(state, h, s3));
    const next = [state[0], state[1], state[2]];
    for (let i = 0; i < next.length; ++i) {
      next[i] += h / 6 * (s1[i] + 2 * s2[i] + 2 * s3[i] + s4[i]);
    }
    return next;
  }

  // samples up to tFinal, or up to where the state is no longer finite
  function simulate() {
    const steps = Math.round(tFinal / h);
    const trajectory = [{ t: 0, state: [x1Start, x2Start, thetaHatStart] }];
    for (let i = 0; i < steps; ++i) {
      const t = i * h;  // from the index: a running sum would drift
      const next = rk4Step(t, trajectory[i].state);
      if (!Number.isFinite(next[0] + next[1] + next[2])) {
        break;
      }
      trajectory.push({ t: (i + 1) * h, state: next });
    }
    return trajectory;
  }

  // ---- Write CSV ----

  function toCsv(trajectory) {
    const rows = trajectory.map(({ t, state: [x1, x2, thetaHat] }) => {
      const { r } = reference(t);
      return `${t},${x1},${x2},${thetaHat},${r},${x1 - r}\n`;
    });
    return `t,x1,x2,theta_hat,reference,tracking_error\n${rows.join("")}`;
  }

  // ---- Figures ----

  function signals({ t, state: [x1, x2, thetaHat] }) {
    const { z1, z2 } = controller(t, x1, x2, thetaHat);
    const V = z1 ** 2 / 2 + z2 ** 2 / 2 + (thetaHat - theta) ** 2 / (2 * gamma);
    return { x1, r: x1 - z1, z1, thetaHat, V };
  }

  return { simulate, toCsv, signals };
}
