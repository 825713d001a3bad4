# MATLAB and Simulink: run as they are; under GNU Octave with what octave/ supplies.
# They are slow, so they come first: make -j2 ends earlier.
KNOWN_PORTS := simulink matlab $(KNOWN_PORTS)
FOLDER.matlab := matlab
FOLDER.simulink := matlab

build/matlab/done: matlab/port.toml matlab/Chapter17_Lesson1.m matlab/octave/run_program.m
build/simulink/done: matlab/port.toml matlab/Chapter17_Lesson1_Simulink.m $(wildcard matlab/octave/*.m)
