// SPDX-License-Identifier: MIT
//
// Chapter 17, Lesson 1: adaptive backstepping on an uncertain second-order plant.
//
//     plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
//     task      x1 follows r(t), and every signal stays bounded
//     notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
//               phi: regressor;  theta: unknown parameter (1/s);  theta_hat: estimate of theta;
//               x_dot: time derivative of x;
//               x_dot_known: x_dot with theta_hat in the place of theta, as if constant;
//               alpha1_x1: partial derivative of alpha1 with respect to x1
//     (n)       section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1
//
//     build     g++ -std=c++17 -O2 -o Chapter17_Lesson1 Chapter17_Lesson1.cpp
//     run       ./Chapter17_Lesson1

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

constexpr double theta_true = 1.2;       // (15) true parameter, unknown to the controller, 1/s
constexpr double k1 = 2.0;               // (15) gain on z1, positive
constexpr double k2 = 2.5;               // (15) gain on z2, positive
constexpr double gamma_gain = 3.0;       // (15) adaptation gain, positive
constexpr double amplitude = 0.5;        // (15) of the reference
constexpr double omega = 0.7;            // (15) of the reference, rad/s
constexpr double x1_start = 1.2;         // (15) x1 at t = 0
constexpr double x2_start = -0.5;        // (15) x2 at t = 0
constexpr double theta_hat_start = 0.0;  // (15) theta_hat at t = 0
constexpr double final_time = 20.0;      // (15) horizon, s
constexpr double h = 0.002;              // step of RK4, and interval between logged times, s

constexpr const char* csv_name = "Chapter17_Lesson1_cpp.csv";

// ---- Reference ----

struct Reference {
    double r;
    double r_dot;
    double r_ddot;
};

Reference reference(double t) {
    const double r = amplitude * std::sin(omega * t);                        // (15) reference
    const double r_dot = amplitude * omega * std::cos(omega * t);            // (15) its first derivative
    const double r_ddot = -amplitude * omega * omega * std::sin(omega * t);  // (15) its second derivative
    return {r, r_dot, r_ddot};
}

// ---- Controller ----

double regressor(double x1) {
    const double phi = x1;  // (4) regressor
    return phi;
}

struct Control {
    double u;
    double theta_hat_dot;
};

Control controller(double t, double x1, double x2, double theta_hat) {
    const auto [r, r_dot, r_ddot] = reference(t);
    const double phi = regressor(x1);
    const double z1 = x1 - r;                                  // (5) tracking error
    const double alpha1 = -k1 * z1 - theta_hat * phi + r_dot;  // (7) virtual control
    const double z2 = x2 - alpha1;                             // (5) deviation from the virtual control
    // phi(x1) = x1 has the derivative 1
    const double alpha1_x1 = -k1 - theta_hat;             // (7) partial derivative of alpha1 by x1
    const double tau2 = phi * z1 - alpha1_x1 * phi * z2;  // (7) tuning function
    const double theta_hat_dot = gamma_gain * tau2;       // (7) update law
    // alpha1' with theta_hat in the place of theta, as if constant
    const double alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * phi) + k1 * r_dot + r_ddot;  // (7) known part
    // alpha1 moves with theta_hat too: hence the last term
    const double u = alpha1_dot_known - z1 - k2 * z2 - phi * theta_hat_dot;  // (7) control
    return {u, theta_hat_dot};
}

// ---- Closed loop ----

using State = std::array<double, 3>;  // x1, x2, theta_hat

State closed_loop(double t, const State& state) {
    const auto [x1, x2, theta_hat] = state;
    const auto [u, theta_hat_dot] = controller(t, x1, x2, theta_hat);
    const double phi = regressor(x1);
    const double x1_dot = x2 + theta_true * phi;  // (7) plant, row 1
    const double x2_dot = u;                      // (7) plant, row 2
    return {x1_dot, x2_dot, theta_hat_dot};
}

// ---- Integrate ----

// the state after a step of the given length along the slope
State add_scaled(const State& state, const State& slope, double step) {
    State sum = state;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        sum[i] += step * slope[i];
    }
    return sum;
}

// slopes at the start, twice at the middle, and at the end of the step
State rk4_step(double t, const State& state, double h) {
    const State k_1 = closed_loop(t, state);
    const State k_2 = closed_loop(t + h / 2, add_scaled(state, k_1, h / 2));
    const State k_3 = closed_loop(t + h / 2, add_scaled(state, k_2, h / 2));
    const State k_4 = closed_loop(t + h, add_scaled(state, k_3, h));
    State next = state;
    for (std::size_t i = 0; i < next.size(); ++i) {
        next[i] += h / 6 * (k_1[i] + 2 * k_2[i] + 2 * k_3[i] + k_4[i]);
    }
    return next;
}

struct Sample {
    double t;
    State state;
};

std::vector<Sample> simulate() {
    const State initial_state = {x1_start, x2_start, theta_hat_start};
    const long steps = std::lround(final_time / h);
    std::vector<Sample> trajectory = {{0.0, initial_state}};
    for (long i = 0; i < steps; ++i) {
        const double t = static_cast<double>(i) * h;  // from the index: a running sum would drift
        const State state = rk4_step(t, trajectory.back().state, h);
        for (const double value : state) {
            if (!std::isfinite(value)) {
                throw std::runtime_error("integration failed at t = " + std::to_string(t) + ": state not finite");
            }
        }
        trajectory.push_back({static_cast<double>(i + 1) * h, state});
    }
    return trajectory;
}

// ---- Write CSV ----

std::string round_trip(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

void write_csv(const std::vector<Sample>& trajectory) {
    // renamed when complete, so that no half-written CSV looks whole
    const std::string part = std::string(csv_name) + ".part";
    std::ofstream file;
    file.exceptions(std::ios::failbit | std::ios::badbit);
    try {
        file.open(part, std::ios::binary);
        file << "t,x1,x2,theta_hat,reference,tracking_error\n";
        for (const auto& [t, state] : trajectory) {
            const auto [x1, x2, theta_hat] = state;
            const double r = reference(t).r;
            const double tracking_error = x1 - r;
            file << round_trip(t) << ',' << round_trip(x1) << ',' << round_trip(x2) << ','
                 << round_trip(theta_hat) << ',' << round_trip(r) << ',' << round_trip(tracking_error) << '\n';
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
    const double final_ref = reference(t).r;
    std::printf("Final tracking error: %.6e\n", x1 - final_ref);
    std::printf("Final parameter estimate: %.10f\n", theta_hat);
    std::printf("True parameter: %.10f\n", theta_true);
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
