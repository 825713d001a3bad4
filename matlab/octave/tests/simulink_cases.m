% Diagrams that are wrong, one after another: prints "case: message" for each, and "case: no error" where none came.
% SPDX-License-Identifier: MIT
function simulink_cases()
  refused('unknown block', @(m) add_block('simulink/Sources/Clok', [m '/Clock 2']));
  refused('unknown parameter', @(m) add_block('simulink/Sources/Clock', [m '/Clock 2'], 'Speed', '1'));
  refused('value that is no text', @(m) set_param(m, 'RelTol', 1e-9));
  refused('unknown model parameter', @(m) set_param(m, 'RelTolerance', '1e-9'));
  refused('block twice', @(m) add_block('simulink/Sources/Clock', [m '/Clock']));
  refused('unknown block in a line', @(m) add_line(m, 'Clack/1', 'Loop/1'));
  refused('wrong output port', @(m) add_line(m, 'Clock/2', 'Loop/1'));
  refused('wrong input port', @(m) add_line(m, 'Clock/1', 'Loop/3'));
  refused('doubled line', @(m) add_line(m, 'Clock/1', 'Loop/1'));
  refused('missing line', @(m) wired(m, {'Clock/1', 'Loop/1'; 'Loop/1', 'Integrator/1'}));
  refused('algebraic loop', @(m) wired(m, {'Clock/1', 'Loop/1'; 'Loop/2', 'Loop/2'; 'Loop/1', 'Integrator/1'; 'Integrator/1', 'Log/1'}));
  refused('wrong width', @(m) scripted(m, sprintf('function [x_dot, y] = f(t, x)\nx_dot = [x; x]; y = t;\nend')));
  refused('no initial condition', @(m) simulated(m, 'Integrator', 'InitialCondition', 'x'));
  refused('unknown save format', @(m) simulated(m, 'Log', 'SaveFormat', 'Table'));
  refused('another solver', @(m) simulated(m, '', 'Solver', 'ode15s'));
  refused('unset tolerance', @(m) simulated(m, '', 'AbsTol', 'auto'));
  refused('script without a signature', @(m) scripted(m, 'x_dot = -x;'));
  refused('script that fails', @(m) scripted(m, sprintf('function [x_dot, y] = f(t, x)\nx_dot = -x; y = nowhere;\nend')));
  refused('state that blows up', @(m) scripted(m, sprintf('function [x_dot, y] = f(t, x)\nx_dot = x / 0; y = t;\nend')));
  refused('unknown model', @(m) sim('another', 'ReturnWorkspaceOutputs', 'on'));
  refused('model twice', @(m) new_system(m));
  refused('right diagram', @(m) simulated(m, '', 'RelTol', '1e-9'));
  log = decay();
  printf('value at 1: %.9f\n', log.signals.values(end));
  printf('last time: %g\n', log.time(end));
end

function refused(name, action)
  model = 'test_model';
  build(model);
  message = 'no error';
  try
    action(model);
  catch problem
    message = strtrim(problem.message);
  end
  printf('%s: %s\n', name, message);
  close_system(model, 0);
end

function build(model)
  % x' = -x, x(0) = 1, complete but for the line to the second input of Loop
  new_system(model);
  add_block('simulink/Sources/Clock', [model '/Clock']);
  add_block('simulink/User-Defined Functions/MATLAB Function', [model '/Loop']);
  add_block('simulink/Continuous/Integrator', [model '/Integrator'], 'InitialCondition', '1');
  add_block('simulink/Sinks/To Workspace', [model '/Log'], 'VariableName', 'x', 'SaveFormat', 'Structure With Time');
  chart = find(get_param(model, 'Object'), '-isa', 'Stateflow.EMChart', 'Path', [model '/Loop']);
  chart.Script = sprintf('function [x_dot, y] = f(t, x)\nx_dot = -x;\ny = t;\nend');
  set_param(model, 'Solver', 'ode45', 'StopTime', '1', 'RelTol', '1e-10', 'AbsTol', '1e-12', 'AutoScaleAbsTol', 'off', 'MaxStep', '0.1');
  add_line(model, 'Clock/1', 'Loop/1');
end

function wired(model, lines)
  close_system(model, 0);
  build(model);
  stored = simulink_models('get', model);
  stored.lines(:) = [];
  simulink_models('put', model, stored);
  for k = 1:rows(lines)
    add_line(model, lines{k, :});
  end
  sim(model, 'ReturnWorkspaceOutputs', 'on');
end

function output = simulated(model, block, varargin)
  path = model;
  if ~isempty(block)
    path = [model '/' block];
  end
  set_param(path, varargin{:});
  add_line(model, 'Integrator/1', 'Loop/2');
  add_line(model, 'Loop/1', 'Integrator/1');
  add_line(model, 'Integrator/1', 'Log/1');
  output = sim(model, 'ReturnWorkspaceOutputs', 'on');
end

function scripted(model, script)
  chart = find(get_param(model, 'Object'), '-isa', 'Stateflow.EMChart', 'Path', [model '/Loop']);
  chart.Script = script;
  simulated(model, '', 'RelTol', '1e-9');
end

function log = decay()
  build('decay');
  log = simulated('decay', '', 'RelTol', '1e-10').x;
  close_system('decay', 0);
end
