// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant; the playground's program.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               phi: regressor;  theta: unknown parameter (1/s);  thetaHat: estimate of theta;
//               xDot: time derivative of x;  xDotKnown: what of xDot is known;
//               alpha1X1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson

// ---- Parameters ----

const h = 0.002;  // step of RK4, and interval between logged times, s

// (15) the sliders' values; omega in rad/s, finalTime in s
function program({ theta: thetaTrue, k1, k2, gamma, amplitude, omega, x1Start, x2Start, thetaHatStart, finalTime }) {

  // ---- Reference ----

  function reference(t) {
    const r = amplitude * Math.sin(omega * t);                       // (15) reference
    const rDot = amplitude * omega * Math.cos(omega * t);            // (15) its first derivative
    const rDDot = -amplitude * omega * omega * Math.sin(omega * t);  // (15) its second derivative
    return { r, rDot, rDDot };
  }

  // ---- Controller ----

  function regressor(x1) {
    const phi = x1;  // (4) regressor
    return phi;
  }

  function controller(t, x1, x2, thetaHat) {
    const { r, rDot, rDDot } = reference(t);
    const phi = regressor(x1);
    const z1 = x1 - r;                                // (5) tracking error
    const alpha1 = -k1 * z1 - thetaHat * phi + rDot;  // (7) virtual control
    const z2 = x2 - alpha1;                           // (5) distance from the virtual control
    // phi(x1) = x1 has the derivative 1
    const alpha1X1 = -k1 - thetaHat;              // (7) partial derivative of alpha1
    const tau2 = phi * z1 - alpha1X1 * phi * z2;  // (7) tuning function
    const thetaHatDot = gamma * tau2;             // (7) update law
    // alpha1' contains theta, by x1': this is what is left of it with thetaHat in theta's place
    const alpha1DotKnown = alpha1X1 * (x2 + thetaHat * phi) + k1 * rDot + rDDot;  // (7) known part
    // alpha1 moves with thetaHat too: hence the last term
    const u = alpha1DotKnown - z1 - k2 * z2 - phi * thetaHatDot;  // (7) control
    return { u, thetaHatDot, z1, z2 };
  }

  // ---- Closed loop ----

  function closedLoop(t, state) {
    const x1 = state[0];
    const x2 = state[1];
    const thetaHat = state[2];
    const { u, thetaHatDot } = controller(t, x1, x2, thetaHat);
    const phi = regressor(x1);
    const x1Dot = x2 + thetaTrue * phi;  // (7) plant, row 1
    const x2Dot = u;                     // (7) plant, row 2
    return [x1Dot, x2Dot, thetaHatDot];
  }

  // ---- Integrate ----

  // the state after a step of the given length along the slope
  function addScaled(state, slope, step) {
    const sum = [...state];
    for (let i = 0; i < sum.length; ++i) {
      sum[i] += step * slope[i];
    }
    return sum;
  }

  // slopes at the start, twice at the middle, and at the end of the step
  function rk4Step(t, state, h) {
    const k_1 = closedLoop(t, state);
    const k_2 = closedLoop(t + h / 2, addScaled(state, k_1, h / 2));
    const k_3 = closedLoop(t + h / 2, addScaled(state, k_2, h / 2));
    const k_4 = closedLoop(t + h, addScaled(state, k_3, h));
    const next = [...state];
    for (let i = 0; i < next.length; ++i) {
      next[i] += h / 6 * (k_1[i] + 2 * k_2[i] + 2 * k_3[i] + k_4[i]);
    }
    return next;
  }

  // samples up to finalTime, or up to where the state is no longer finite
  function simulate() {
    const steps = Math.round(finalTime / h);
    const trajectory = [{ t: 0, state: [x1Start, x2Start, thetaHatStart] }];
    for (let i = 0; i < steps; ++i) {
      const t = i * h;  // from the index: a running sum would drift
      const next = rk4Step(t, trajectory[i].state, h);
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
    const V = z1 ** 2 / 2 + z2 ** 2 / 2 + (thetaHat - thetaTrue) ** 2 / (2 * gamma);
    return { x1, r: x1 - z1, z1, thetaHat, V };
  }

  return { simulate, toCsv, signals };
}
