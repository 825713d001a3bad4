% Run a program of matlab/ under GNU Octave: octave-cli --norc run_program.m Chapter17_Lesson1
% SPDX-License-Identifier: MIT
here = fileparts(mfilename('fullpath'));
addpath(here, fileparts(here));
warning('off', 'Octave:gnuplot-graphics');  % a remark on the toolkit, not on the program
warning('off', 'integrate_adaptive:unexpected_termination');  % the programs say so themselves
feval(argv(){end});
if ~isempty(simulink_models('names', ''))
  error('a model is left open: %s\n', strjoin(simulink_models('names', ''), ', '));
end
