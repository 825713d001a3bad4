// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               theta_hat: estimate of theta;  x_dot: time derivative of x;
//               alpha1_x1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace {

// ---- Parameters ----

constexpr double theta = 1.2;            // (10) true parameter, used by the plant alone
constexpr double k1 = 2.0;               // (10) gain on z1, positive
constexpr double k2 = 2.5;               // (10) gain on z2, positive
constexpr double gamma = 3.0;            // (10) adaptation gain, positive
constexpr double amplitude = 0.5;        // (10) of the reference
constexpr double omega = 0.7;            // (10) of the reference, rad/s
constexpr double x1_start = 1.2;         // (10) x1 at t = 0
constexpr double x2_start = -0.5;        // (10) x2 at t = 0
constexpr double theta_hat_start = 0.0;  // (10) theta_hat at t = 0
constexpr double t_final = 20.0;         // (10) horizon, s
constexpr double h = 0.002;              // step of RK4, and interval between logged times, s

constexpr const char* csv_name = "Chapter17_Lesson1_cpp.csv";

// ---- Reference ----

struct Reference {
    double r;
    double r_dot;
    double r_ddot;
};

Reference reference(double t) {
    const double r = amplitude * std::sin(omega * t);                        // (10) reference
    const double r_dot = amplitude * omega * std::cos(omega * t);            // (10) its first derivative
    const double r_ddot = -amplitude * omega * omega * std::sin(omega * t);  // (10) its second derivative
    return {r, r_dot, r_ddot};
}

// ---- Controller ----

struct Control {
    double u;
    double theta_hat_dot;
};

Control controller(double t, double x1, double x2, double theta_hat) {
    const auto [r, r_dot, r_ddot] = reference(t);
    const double z1 = x1 - r;                                 // (5) tracking error
    const double alpha1 = -k1 * z1 - theta_hat * x1 + r_dot;  // (7) virtual control
    const double z2 = x2 - alpha1;                            // (5) distance from the virtual control
    const double alpha1_x1 = -k1 - theta_hat;                 // (7) partial derivative of alpha1
    const double tau2 = x1 * z1 - alpha1_x1 * x1 * z2;        // (7) tuning function
    const double theta_hat_dot = gamma * tau2;                // (7) update law
    const double alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot;  // (7) known part of alpha1'
    const double u = alpha1_dot_known - z1 - k2 * z2 - x1 * theta_hat_dot;  // (7) control
    return {u, theta_hat_dot};
}

// ---- Closed loop ----

using State = std::array<double, 3>;  // x1, x2, theta_hat

State closed_loop(double t, const State& state) {
    const auto [x1, x2, theta_hat] = state;
    const auto [u, theta_hat_dot] = controller(t, x1, x2, theta_hat);
    const double x1_dot = x2 + theta * x1;  // (7) plant, row 1
    const double x2_dot = u;                // (7) plant, row 2
    return {x1_dot, x2_dot, theta_hat_dot};
}

// ---- Integrate ----

State along(const State& state, double step, const State& slope) {
    return {state[0] + step * slope[0], state[1] + step * slope[1], state[2] + step * slope[2]};
}

// slopes at the start, twice at the middle, and at the end of the step
State rk4_step(double t, const State& state) {
    const State s1 = closed_loop(t, state);
    const State s2 = closed_loop(t + h / 2, along(state, h / 2, s1));
    const State s3 = closed_loop(t + h / 2, along(state, h / 2, s2));
    const State s4 = closed_loop(t + h, along(state, h, s3));
    State next = state;
    for (std::size_t i = 0; i < next.size(); ++i) {
        next[i] += h / 6 * (s1[i] + 2 * s2[i] + 2 * s3[i] + s4[i]);
    }
    return next;
}

struct Sample {
    double t;
    State state;
};

std::vector<Sample> simulate() {
    const long steps = std::lround(t_final / h);
    std::vector<Sample> trajectory = {{0.0, {x1_start, x2_start, theta_hat_start}}};
    for (long i = 0; i < steps; ++i) {
        const double t = static_cast<double>(i) * h;  // from the index: a running sum would drift
        const State next = rk4_step(t, trajectory.back().state);
        if (!std::isfinite(next[0] + next[1] + next[2])) {
            throw std::runtime_error("integration failed at t = " + std::to_string(t) + ": the state is not finite");
        }
        trajectory.push_back({static_cast<double>(i + 1) * h, next});
    }
    return trajectory;
}

// ---- Write CSV ----

std::string round_trip(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

void write_csv(const std::vector<Sample>& trajectory) {
    const std::string part = std::string(csv_name) + ".part";  // renamed when complete, so that no half-written CSV looks whole
    std::ofstream file;
    file.exceptions(std::ios::failbit | std::ios::badbit);
    try {
        file.open(part, std::ios::binary);
        file << "t,x1,x2,theta_hat,reference,tracking_error\n";
        for (const auto& [t, state] : trajectory) {
            const auto [x1, x2, theta_hat] = state;
            const double r = reference(t).r;
            file << round_trip(t) << ',' << round_trip(x1) << ',' << round_trip(x2) << ',' << round_trip(theta_hat) << ','
                 << round_trip(r) << ',' << round_trip(x1 - r) << '\n';
        }
        file.close();
    } catch (const std::ios::failure&) {
        throw std::runtime_error("cannot write " + part);
    }
    std::error_code failure;
    std::filesystem::rename(part, csv_name, failure);
    if (failure) {
        throw std::runtime_error(std::string("cannot write ") + csv_name + ": " + failure.message());
    }
}

// ---- Report ----

void report(const std::vector<Sample>& trajectory) {
    const auto& [t, state] = trajectory.back();
    const auto [x1, x2, theta_hat] = state;
    std::printf("Final tracking error: %.6e\n", x1 - reference(t).r);
    std::printf("Final parameter estimate: %.10f\n", theta_hat);
    std::printf("True parameter: %.10f\n", theta);
    std::printf("Data written to %s\n", csv_name);
    if (std::fflush(stdout) != 0) {
        throw std::runtime_error("cannot write to standard output");
    }
}

}  // namespace

int main() {
    try {
        const std::vector<Sample> trajectory = simulate();
        write_csv(trajectory);
        report(trajectory);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "Chapter17_Lesson1: %s\n", error.what());
        return 1;
    }
}
