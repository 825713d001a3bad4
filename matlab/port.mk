# MATLAB and Simulink: run as they are; under GNU Octave with what octave/ supplies.
KNOWN_PORTS += matlab simulink
FOLDER.matlab := matlab
FOLDER.simulink := matlab

build/matlab/done: matlab/port.toml matlab/Chapter17_Lesson1.m matlab/octave/run_program.m
build/simulink/done: matlab/port.toml matlab/Chapter17_Lesson1_Simulink.m $(wildcard matlab/octave/*.m)
