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
//     build     go build Chapter17_Lesson1.go
//     run       ./Chapter17_Lesson1

package main

import (
	"bufio"
	"fmt"
	"math"
	"os"
	"strconv"
)

// ---- Parameters ----

const (
	thetaTrue     = 1.2   // (15) true parameter, unknown to the controller, 1/s
	k1            = 2.0   // (15) gain on z1, positive
	k2            = 2.5   // (15) gain on z2, positive
	gamma         = 3.0   // (15) adaptation gain, positive
	amplitude     = 0.5   // (15) of the reference
	omega         = 0.7   // (15) of the reference, rad/s
	x1Start       = 1.2   // (15) x1 at t = 0
	x2Start       = -0.5  // (15) x2 at t = 0
	thetaHatStart = 0.0   // (15) thetaHat at t = 0
	finalTime     = 20.0  // (15) horizon, s
	h             = 0.002 // step of RK4, and interval between logged times, s

	csvName = "Chapter17_Lesson1_go.csv"
)

// ---- Reference ----

func reference(t float64) (float64, float64, float64) {
	r := amplitude * math.Sin(omega*t)                      // (15) reference
	rDot := amplitude * omega * math.Cos(omega*t)           // (15) its first derivative
	rDDot := -amplitude * omega * omega * math.Sin(omega*t) // (15) its second derivative
	return r, rDot, rDDot
}

// ---- Controller ----

func controller(t, x1, x2, thetaHat float64) (float64, float64, float64) {
	r, rDot, rDDot := reference(t)
	phi := x1                              // (4) regressor
	z1 := x1 - r                           // (5) tracking error
	alpha1 := -k1*z1 - thetaHat*phi + rDot // (7) virtual control
	z2 := x2 - alpha1                      // (5) deviation from the virtual control
	// phi(x1) = x1 has the derivative 1
	alpha1X1 := -k1 - thetaHat       // (7) partial derivative of alpha1 by x1
	tau2 := phi*z1 - alpha1X1*phi*z2 // (7) tuning function
	thetaHatDot := gamma * tau2      // (7) update law
	// alpha1' with thetaHat in the place of theta, as if constant
	alpha1DotKnown := alpha1X1*(x2+thetaHat*phi) + k1*rDot + rDDot // (7) known part
	// alpha1 moves with thetaHat too: hence the last term
	u := alpha1DotKnown - z1 - k2*z2 - phi*thetaHatDot // (7) control
	return u, thetaHatDot, phi
}

// ---- Closed loop ----

type state [3]float64 // x1, x2, thetaHat

func closedLoop(t float64, s state) state {
	x1, x2, thetaHat := s[0], s[1], s[2]
	u, thetaHatDot, phi := controller(t, x1, x2, thetaHat)
	x1Dot := x2 + thetaTrue*phi // (7) plant, row 1
	x2Dot := u                  // (7) plant, row 2
	return state{x1Dot, x2Dot, thetaHatDot}
}

// ---- Integrate ----

// the state after a step of the given length along the slope
func addScaled(s, slope state, step float64) state {
	for i := range s {
		s[i] += step * slope[i]
	}
	return s
}

// slopes at the start, twice at the middle, and at the end of the step
func rk4Step(t float64, s state) state {
	s1 := closedLoop(t, s)
	s2 := closedLoop(t+h/2, addScaled(s, s1, h/2))
	s3 := closedLoop(t+h/2, addScaled(s, s2, h/2))
	s4 := closedLoop(t+h, addScaled(s, s3, h))
	for i := range s {
		s[i] += h / 6 * (s1[i] + 2*s2[i] + 2*s3[i] + s4[i])
	}
	return s
}

func simulate() ([]state, error) {
	steps := int(math.Round(finalTime / h))
	states := []state{{x1Start, x2Start, thetaHatStart}}
	for i := 0; i < steps; i++ {
		t := float64(i) * h // from the index: a running sum would drift
		next := rk4Step(t, states[i])
		for _, value := range next {
			if math.IsNaN(value) || math.IsInf(value, 0) {
				return nil, fmt.Errorf("integration failed at t = %v: state not finite", t)
			}
		}
		states = append(states, next)
	}
	return states, nil
}

// ---- Write CSV ----

func roundTrip(value float64) string {
	return strconv.FormatFloat(value, 'g', -1, 64)
}

func writeCSV(states []state) error {
	part := csvName + ".part" // renamed when complete, so that no half-written CSV looks whole
	file, err := os.Create(part)
	if err != nil {
		return err
	}
	rows := bufio.NewWriter(file)
	fmt.Fprintln(rows, "t,x1,x2,theta_hat,reference,tracking_error")
	for i, s := range states {
		t := float64(i) * h
		r, _, _ := reference(t)
		for _, value := range []float64{t, s[0], s[1], s[2], r} {
			fmt.Fprint(rows, roundTrip(value), ",")
		}
		fmt.Fprintln(rows, roundTrip(s[0]-r))
	}
	if err := rows.Flush(); err != nil {
		return err
	}
	if err := file.Close(); err != nil {
		return err
	}
	return os.Rename(part, csvName)
}

// ---- Report ----

func report(states []state) error {
	last := states[len(states)-1]
	r, _, _ := reference(float64(len(states)-1) * h)
	_, err := fmt.Printf("Final tracking error: %.6e\nFinal parameter estimate: %.10f\n"+
		"True parameter: %.10f\nData written to %s\n", last[0]-r, last[2], thetaTrue, csvName)
	return err
}

func main() {
	states, err := simulate()
	if err == nil {
		err = writeCSV(states)
	}
	if err == nil {
		err = report(states)
	}
	if err != nil {
		fmt.Fprintln(os.Stderr, "Chapter17_Lesson1:", err)
		os.Exit(1)
	}
}
