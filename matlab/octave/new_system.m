function new_system(name)
%new_system  An empty model of that name in memory, with Simulink's default solver settings.
% SPDX-License-Identifier: MIT
  if simulink_models('has', name)
    error('Simulink:Commands:NewSysAlreadyExists', 'there is already a model named ''%s''\n', name);
  end
  parameters = struct('SolverType', 'Variable-step', 'Solver', 'VariableStepAuto', 'StartTime', '0.0', ...
                      'StopTime', '10.0', 'RelTol', '1e-3', 'AbsTol', 'auto', ...
                      'AutoScaleAbsTol', 'on', 'MaxStep', 'auto', ...
                      'ReturnWorkspaceOutputs', 'off');
  blocks = struct('name', {}, 'source', {}, 'parameters', {}, 'chart', {});
  lines = struct('from', {}, 'out', {}, 'to', {}, 'in', {});
  simulink_models('put', name, struct('name', name, 'parameters', parameters, 'blocks', blocks, 'lines', lines));
end
