# SPDX-License-Identifier: MIT
#
# Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.
#
#     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
#     task      x1 follows r(t), and every signal stays bounded
#     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
#               phi: regressor;  theta: unknown parameter (1/s);  theta_hat: estimate of theta;
#               x_dot: time derivative of x;
#               x_dot_known: x_dot with theta_hat in the place of theta, as if constant;
#               alpha1_x1: partial derivative of alpha1 with respect to x1
#     (n)       section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1
#
#     run       awk -f Chapter17_Lesson1.awk

# ---- Parameters ----

BEGIN {
    theta_true = 1.2  # (15) true parameter, unknown to the controller, 1/s
    k1 = 2.0  # (15) gain on z1, positive
    k2 = 2.5  # (15) gain on z2, positive
    gamma = 3.0  # (15) adaptation gain, positive
    amplitude = 0.5  # (15) of the reference
    omega = 0.7  # (15) of the reference, rad/s
    x1_start = 1.2  # (15) x1 at t = 0
    x2_start = -0.5  # (15) x2 at t = 0
    theta_hat_start = 0.0  # (15) theta_hat at t = 0
    final_time = 20.0  # (15) horizon, s
    h = 0.002  # step of RK4, and interval between logged times, s
    csv_name = "Chapter17_Lesson1_NAME.csv"
    main()
}

# ---- Reference ----

function reference(t) {
    r = amplitude * sin(omega * t)  # (15) reference
    r_dot = amplitude * omega * cos(omega * t)  # (15) its first derivative
    r_ddot = -amplitude * omega * omega * sin(omega * t)  # (15) its second derivative
}

# ---- Controller ----

function controller(t, x1, x2, theta_hat) {
    reference(t)
    phi = x1  # (4) regressor
    z1 = x1 - r  # (5) tracking error
    alpha1 = -k1 * z1 - theta_hat * phi + r_dot  # (7) virtual control
    z2 = x2 - alpha1  # (5) deviation from the virtual control
    # phi(x1) = x1 has the derivative 1
    alpha1_x1 = -k1 - theta_hat  # (7) partial derivative of alpha1 by x1
    tau2 = phi * z1 - alpha1_x1 * phi * z2  # (7) tuning function
    theta_hat_dot = gamma * tau2  # (7) update law
    # alpha1' with theta_hat in the place of theta, as if constant
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * phi) + k1 * r_dot + r_ddot  # (7) known part
    # alpha1 moves with theta_hat too: hence the last term
    u = alpha1_dot_known - z1 - k2 * z2 - phi * theta_hat_dot  # (7) control
}

# ---- Closed loop ----

function closed_loop(t, x1, x2, theta_hat) {
    controller(t, x1, x2, theta_hat)
    x1_dot = x2 + theta_true * phi  # (7) plant, row 1
    x2_dot = u  # (7) plant, row 2
}

# ---- Integrate ----

# adds weight times the slope at the state after a step of the given length along the last slope
function stage(t, step, weight) {
    closed_loop(t, x[1] + step * x1_dot, x[2] + step * x2_dot, x[3] + step * theta_hat_dot)
    sum[1] += weight * x1_dot
    sum[2] += weight * x2_dot
    sum[3] += weight * theta_hat_dot
}

# slopes at the start, twice at the middle, and at the end of the step
function rk4_step(t,    i) {
    for (i = 1; i <= 3; i++) sum[i] = 0
    x1_dot = x2_dot = theta_hat_dot = 0
    stage(t, 0, 1)
    stage(t + h / 2, h / 2, 2)
    stage(t + h / 2, h / 2, 2)
    stage(t + h, h, 1)
    for (i = 1; i <= 3; i++) x[i] += h / 6 * sum[i]
}

function fail(reason) {
    print "Chapter17_Lesson1: " reason > "/dev/stderr"
    exit 1
}

# logs the state at t = i h, from the index: a running sum would drift
function simulate(    i, steps) {
    steps = int(final_time / h + 1 / 2)
    x[1] = x1_start
    x[2] = x2_start
    x[3] = theta_hat_start
    begin_csv()
    for (i = 0; i < steps; i++) {
        write_row(i * h)
        rk4_step(i * h)
        for (j = 1; j <= 3; j++) if (sprintf("%g", x[j]) ~ /n/) fail("integration failed at t = " i * h ": state not finite")
    }
    write_row(steps * h)
    end_csv()
}

# ---- Write CSV ----

# under another name until it is complete, so that no half-written CSV looks whole
function begin_csv() {
    part = csv_name ".part"
    writer = "cat > " part
    if (system("test ! -d " csv_name)) fail("cannot write " csv_name)
    print "t,x1,x2,theta_hat,reference,tracking_error" | writer
}

function write_row(t) {
    reference(t)
    printf "%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", t, x[1], x[2], x[3], r, x[1] - r | writer
}

function end_csv() {
    if (close(writer)) exit 1  # it has said why
    if (system("mv " part " " csv_name)) fail("cannot write " csv_name)
}

# ---- Report ----

function report() {
    printf "Final tracking error: %.6e\n", x[1] - r
    printf "Final parameter estimate: %.10f\n", x[3]
    printf "True parameter: %.10f\n", theta_true
    print "Data written to " csv_name
}

function main() {
    simulate()
    report()
}
