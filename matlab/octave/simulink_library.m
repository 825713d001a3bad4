function entry = simulink_library(source)
%simulink_library  The library blocks that this stand-in for Simulink knows.
%   entry = simulink_library('simulink/Sources/Clock') is a struct: inputs and outputs, the numbers of ports (a
%   MATLAB Function block takes its own from its Script); feedthrough, whether an output depends on an input at
%   the same instant; parameters, the block's own with their defaults.  An unknown path is an error.
% SPDX-License-Identifier: MIT
  switch source
    case 'simulink/Sources/Clock'
      entry = block(0, 1, false, struct());
    case 'simulink/Continuous/Integrator'
      entry = block(1, 1, false, struct('InitialCondition', '0'));
    case 'simulink/User-Defined Functions/MATLAB Function'
      entry = block(1, 1, true, struct());
    case 'simulink/Sinks/To Workspace'
      entry = block(1, 0, false, struct('VariableName', 'simout', 'SaveFormat', 'Timeseries', 'MaxDataPoints', 'inf'));
    otherwise
      error('Simulink:Commands:AddBlockCantAdd', 'there is no library block named ''%s''\n', source);
  end
end

function entry = block(inputs, outputs, feedthrough, parameters)
  parameters.Position = [0, 0, 30, 30];
  entry = struct('inputs', inputs, 'outputs', outputs, 'feedthrough', feedthrough, 'parameters', parameters);
end
