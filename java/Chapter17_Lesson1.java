// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               thetaHat: estimate of theta;  xDot: time derivative of x;
//               alpha1X1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson

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

    static final double theta = 1.2;          // (10) true parameter, used by the plant alone
    static final double k1 = 2.0;             // (10) gain on z1, positive
    static final double k2 = 2.5;             // (10) gain on z2, positive
    static final double gamma = 3.0;          // (10) adaptation gain, positive
    static final double amplitude = 0.5;      // (10) of the reference
    static final double omega = 0.7;          // (10) of the reference, rad/s
    static final double x1Start = 1.2;        // (10) x1 at t = 0
    static final double x2Start = -0.5;       // (10) x2 at t = 0
    static final double thetaHatStart = 0.0;  // (10) thetaHat at t = 0
    static final double tFinal = 20.0;        // (10) horizon, s
    static final double h = 0.002;            // step of RK4, and interval between logged times, s

    static final String csvName = "Chapter17_Lesson1_java.csv";

    // ---- Reference ----

    record Reference(double r, double rDot, double rDdot) {}

    static Reference reference(double t) {
        final double r = amplitude * Math.sin(omega * t);                       // (10) reference
        final double rDot = amplitude * omega * Math.cos(omega * t);            // (10) its first derivative
        final double rDdot = -amplitude * omega * omega * Math.sin(omega * t);  // (10) its second derivative
        return new Reference(r, rDot, rDdot);
    }

    // ---- Controller ----

    record Control(double u, double thetaHatDot) {}

    static Control controller(double t, double x1, double x2, double thetaHat) {
        final Reference reference = reference(t);
        final double r = reference.r;
        final double rDot = reference.rDot;
        final double rDdot = reference.rDdot;
        final double z1 = x1 - r;                               // (5) tracking error
        final double alpha1 = -k1 * z1 - thetaHat * x1 + rDot;  // (7) virtual control
        final double z2 = x2 - alpha1;                          // (5) distance from the virtual control
        final double alpha1X1 = -k1 - thetaHat;                 // (7) partial derivative of alpha1
        final double tau2 = x1 * z1 - alpha1X1 * x1 * z2;       // (7) tuning function
        final double thetaHatDot = gamma * tau2;                // (7) update law
        final double alpha1DotKnown = alpha1X1 * (x2 + thetaHat * x1) + k1 * rDot + rDdot;  // (7) known part of alpha1'
        final double u = alpha1DotKnown - z1 - k2 * z2 - x1 * thetaHatDot;  // (7) control
        return new Control(u, thetaHatDot);
    }

    // ---- Closed loop ----

    static double[] closedLoop(double t, double[] state) {
        final double x1 = state[0];
        final double x2 = state[1];
        final double thetaHat = state[2];
        final Control control = controller(t, x1, x2, thetaHat);
        final double x1Dot = x2 + theta * x1;  // (7) plant, row 1
        final double x2Dot = control.u;        // (7) plant, row 2
        return new double[] {x1Dot, x2Dot, control.thetaHatDot};
    }

    // ---- Integrate ----

    static double[] along(double[] state, double step, double[] slope) {
        return new double[] {state[0] + step * slope[0], state[1] + step * slope[1], state[2] + step * slope[2]};
    }

    // slopes at the start, twice at the middle, and at the end of the step
    static double[] rk4Step(double t, double[] state) {
        final double[] s1 = closedLoop(t, state);
        final double[] s2 = closedLoop(t + h / 2, along(state, h / 2, s1));
        final double[] s3 = closedLoop(t + h / 2, along(state, h / 2, s2));
        final double[] s4 = closedLoop(t + h, along(state, h, s3));
        final double[] next = state.clone();
        for (int i = 0; i < next.length; ++i) {
            next[i] += h / 6 * (s1[i] + 2 * s2[i] + 2 * s3[i] + s4[i]);
        }
        return next;
    }

    record Sample(double t, double[] state) {}

    static List<Sample> simulate() {
        final long steps = Math.round(tFinal / h);
        final List<Sample> trajectory = new ArrayList<>();
        trajectory.add(new Sample(0.0, new double[] {x1Start, x2Start, thetaHatStart}));
        for (int i = 0; i < steps; ++i) {
            final double t = i * h;  // from the index: a running sum would drift
            final double[] next = rk4Step(t, trajectory.get(i).state);
            if (!Double.isFinite(next[0] + next[1] + next[2])) {
                throw new ArithmeticException("integration failed at t = " + t + ": the state is not finite");
            }
            trajectory.add(new Sample((i + 1) * h, next));
        }
        return trajectory;
    }

    // ---- Write CSV ----

    static void writeCsv(List<Sample> trajectory) throws IOException {
        final Path part = Path.of(csvName + ".part");  // renamed when complete, so that no half-written CSV looks whole
        try (BufferedWriter file = Files.newBufferedWriter(part)) {
            file.write("t,x1,x2,theta_hat,reference,tracking_error\n");
            for (final Sample sample : trajectory) {
                final double t = sample.t;
                final double x1 = sample.state[0];
                final double x2 = sample.state[1];
                final double thetaHat = sample.state[2];
                final double r = reference(t).r;
                file.write(t + "," + x1 + "," + x2 + "," + thetaHat + "," + r + "," + (x1 - r) + "\n");
            }
        }
        Files.move(part, Path.of(csvName), StandardCopyOption.ATOMIC_MOVE);
    }

    // ---- Report ----

    static void report(List<Sample> trajectory) throws IOException {
        final Sample last = trajectory.get(trajectory.size() - 1);
        final double x1 = last.state[0];
        final double thetaHat = last.state[2];
        System.out.printf(Locale.ROOT, "Final tracking error: %.6e\n", x1 - reference(last.t).r);
        System.out.printf(Locale.ROOT, "Final parameter estimate: %.10f\n", thetaHat);
        System.out.printf(Locale.ROOT, "True parameter: %.10f\n", theta);
        System.out.printf(Locale.ROOT, "Data written to %s\n", csvName);
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
