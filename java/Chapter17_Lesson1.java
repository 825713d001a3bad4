// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               phi: regressor;  theta: unknown parameter (1/s);  thetaHat: estimate of theta;
//               xDot: time derivative of x;
//               xDotKnown: xDot with thetaHat in the place of theta, as if constant;
//               alpha1X1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1
//
//     build     javac Chapter17_Lesson1.java
//     run       java Chapter17_Lesson1

import java.io.BufferedWriter;
import java.io.IOException;
import java.nio.file.FileSystemException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.nio.file.StandardCopyOption;
import java.util.ArrayList;
import java.util.List;
import java.util.Locale;

public final class Chapter17_Lesson1 {

    // ---- Parameters ----

    static final double THETA_TRUE = 1.2;       // (15) true parameter, unknown to the controller, 1/s
    static final double K1 = 2.0;               // (15) gain on z1, positive
    static final double K2 = 2.5;               // (15) gain on z2, positive
    static final double GAMMA = 3.0;            // (15) adaptation gain, positive
    static final double AMPLITUDE = 0.5;        // (15) of the reference
    static final double OMEGA = 0.7;            // (15) of the reference, rad/s
    static final double X1_START = 1.2;         // (15) x1 at t = 0
    static final double X2_START = -0.5;        // (15) x2 at t = 0
    static final double THETA_HAT_START = 0.0;  // (15) thetaHat at t = 0
    static final double FINAL_TIME = 20.0;      // (15) horizon, s
    static final double H = 0.002;              // step of RK4, and interval between logged times, s

    static final String CSV_NAME = "Chapter17_Lesson1_java.csv";

    // ---- Reference ----

    record Reference(double r, double rDot, double rDDot) {}

    static Reference reference(double t) {
        final double r = AMPLITUDE * Math.sin(OMEGA * t);             // (15) reference
        final double rDot = AMPLITUDE * OMEGA * Math.cos(OMEGA * t);  // (15) its first derivative
        final double rDDot = -AMPLITUDE * OMEGA * OMEGA * Math.sin(OMEGA * t);  // (15) its second derivative
        return new Reference(r, rDot, rDDot);
    }

    // ---- Controller ----

    static double regressor(double x1) {
        final double phi = x1;  // (4) regressor
        return phi;
    }

    record Control(double u, double thetaHatDot) {}

    static Control controller(double t, double x1, double x2, double thetaHat) {
        final Reference reference = reference(t);
        final double r = reference.r;
        final double rDot = reference.rDot;
        final double rDDot = reference.rDDot;
        final double phi = regressor(x1);
        final double z1 = x1 - r;                                // (5) tracking error
        final double alpha1 = -K1 * z1 - thetaHat * phi + rDot;  // (7) virtual control
        final double z2 = x2 - alpha1;                           // (5) deviation from the virtual control
        // phi(x1) = x1 has the derivative 1
        final double alpha1X1 = -K1 - thetaHat;              // (7) partial derivative of alpha1 by x1
        final double tau2 = phi * z1 - alpha1X1 * phi * z2;  // (7) tuning function
        final double thetaHatDot = GAMMA * tau2;             // (7) update law
        // alpha1' with thetaHat in the place of theta, as if constant
        final double alpha1DotKnown = alpha1X1 * (x2 + thetaHat * phi) + K1 * rDot + rDDot;  // (7) known part
        // alpha1 moves with thetaHat too: hence the last term
        final double u = alpha1DotKnown - z1 - K2 * z2 - phi * thetaHatDot;  // (7) control
        return new Control(u, thetaHatDot);
    }

    // ---- Closed loop ----

    static double[] closedLoop(double t, double[] state) {
        final double x1 = state[0];
        final double x2 = state[1];
        final double thetaHat = state[2];
        final Control control = controller(t, x1, x2, thetaHat);
        final double u = control.u;
        final double thetaHatDot = control.thetaHatDot;
        final double phi = regressor(x1);
        final double x1Dot = x2 + THETA_TRUE * phi;  // (7) plant, row 1
        final double x2Dot = u;                      // (7) plant, row 2
        return new double[] {x1Dot, x2Dot, thetaHatDot};
    }

    // ---- Integrate ----

    // the state after a step of the given length along the slope
    static double[] addScaled(double[] state, double[] slope, double step) {
        final double[] sum = state.clone();
        for (int i = 0; i < sum.length; ++i) {
            sum[i] += step * slope[i];
        }
        return sum;
    }

    // slopes at the start, twice at the middle, and at the end of the step
    static double[] rk4Step(double t, double[] state, double h) {
        final double[] k1 = closedLoop(t, state);
        final double[] k2 = closedLoop(t + h / 2, addScaled(state, k1, h / 2));
        final double[] k3 = closedLoop(t + h / 2, addScaled(state, k2, h / 2));
        final double[] k4 = closedLoop(t + h, addScaled(state, k3, h));
        final double[] next = state.clone();
        for (int i = 0; i < next.length; ++i) {
            next[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
        }
        return next;
    }

    record Sample(double t, double[] state) {}

    static List<Sample> simulate() {
        final double[] initialState = {X1_START, X2_START, THETA_HAT_START};
        final long steps = Math.round(FINAL_TIME / H);
        final List<Sample> trajectory = new ArrayList<>();
        trajectory.add(new Sample(0.0, initialState));
        for (int i = 0; i < steps; ++i) {
            final double t = i * H;  // from the index: a running sum would drift
            final double[] state = rk4Step(t, trajectory.get(i).state, H);
            for (final double value : state) {
                if (!Double.isFinite(value)) {
                    throw new ArithmeticException("integration failed at t = " + t + ": state not finite");
                }
            }
            trajectory.add(new Sample((i + 1) * H, state));
        }
        return trajectory;
    }

    // ---- Write CSV ----

    static void writeCsv(List<Sample> trajectory) throws IOException {
        // renamed when complete, so that no half-written CSV looks whole
        final Path part = Path.of(CSV_NAME + ".part");
        try (BufferedWriter file = Files.newBufferedWriter(part)) {
            file.write("t,x1,x2,theta_hat,reference,tracking_error\n");
            for (final Sample sample : trajectory) {
                final double t = sample.t;
                final double x1 = sample.state[0];
                final double x2 = sample.state[1];
                final double thetaHat = sample.state[2];
                final double r = reference(t).r;
                final double trackingError = x1 - r;
                file.write(t + "," + x1 + "," + x2 + "," + thetaHat + "," + r + "," + trackingError + "\n");
            }
        }
        Files.move(part, Path.of(CSV_NAME), StandardCopyOption.ATOMIC_MOVE);
    }

    // ---- Report ----

    static void report(List<Sample> trajectory) throws IOException {
        final Sample last = trajectory.get(trajectory.size() - 1);
        final double x1 = last.state[0];
        final double thetaHat = last.state[2];
        final double finalRef = reference(last.t).r;
        System.out.printf(Locale.ROOT, "Final tracking error: %.6e\n", x1 - finalRef);
        System.out.printf(Locale.ROOT, "Final parameter estimate: %.10f\n", thetaHat);
        System.out.printf(Locale.ROOT, "True parameter: %.10f\n", THETA_TRUE);
        System.out.printf(Locale.ROOT, "Data written to %s\n", CSV_NAME);
        if (System.out.checkError()) {
            throw new IOException("cannot write to standard output");
        }
    }

    public static void main(String[] arguments) {
        try {
            final List<Sample> trajectory = simulate();
            writeCsv(trajectory);
            report(trajectory);
        } catch (FileSystemException error) {
            System.err.println("Chapter17_Lesson1: cannot write " + error.getFile() + ": " + error.getReason());
            System.exit(1);
        } catch (IOException | ArithmeticException error) {
            System.err.println("Chapter17_Lesson1: " + error.getMessage());
            System.exit(1);
        }
    }
}
