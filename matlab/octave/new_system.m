function new_system(name, kind)
%new_system  An empty model of that name in memory, with Simulink's default settings: new_system('model', 'Model').
% SPDX-License-Identifier: MIT
  if nargin > 1 && ~strcmp(kind, 'Model')
    error('Simulink:Commands:NewSysKind', 'this stand-in for Simulink makes a ''Model'', not a ''%s''\n', kind);
  end
  if simulink_models('has', name)
    error('Simulink:Commands:NewSysAlreadyExists', 'there is already a model named ''%s''\n', name);
  end
  parameters = struct('SolverType', 'Variable-step', 'Solver', 'VariableStepAuto', 'StartTime', '0.0', ...
                      'StopTime', '10.0', 'RelTol', '1e-3', 'AbsTol', 'auto', ...
                      'AutoScaleAbsTol', 'on', 'MaxStep', 'auto', 'Refine', '1', ...
                      'ReturnWorkspaceOutputs', 'on');
  blocks = struct('name', {}, 'source', {}, 'parameters', {}, 'chart', {});
  lines = struct('from', {}, 'out', {}, 'to', {}, 'in', {});
  simulink_models('put', name, struct('name', name, 'parameters', parameters, 'blocks', blocks, 'lines', lines));
end
