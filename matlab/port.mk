# MATLAB and Simulink: run as they are; under GNU Octave with what octave/ supplies.
# They are slow, so they come first: make -j2 ends earlier.
KNOWN_PORTS := simulink matlab $(KNOWN_PORTS)
FOLDER.matlab := matlab
FOLDER.simulink := matlab

$(BUILD)/matlab/done: matlab/port.toml $(FROM)matlab/$(STEM).m $(FROM)matlab/octave/run_program.m
$(BUILD)/simulink/done: matlab/port.toml $(FROM)matlab/$(STEM)_Simulink.m $(addprefix $(FROM),$(wildcard matlab/octave/*.m))
