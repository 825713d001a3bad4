function output = sim(name, varargin)
%sim  Simulate a model in memory: the diagram as it was wired, by ode45, to the solver settings given.
%   output = sim(model, 'ReturnWorkspaceOutputs', 'on') has one field per To Workspace block, named by its VariableName.
%   The blocks are ordered by their lines; an input without a line and an algebraic loop are errors.
% SPDX-License-Identifier: MIT
  model = simulink_models('get', name);
  settings = simulink_assign(model.parameters, ['model ''' name ''''], varargin);
  require(settings, 'SolverType', 'Variable-step');
  require(settings, 'Solver', 'ode45');
  require(settings, 'AutoScaleAbsTol', 'off');
  require(settings, 'ReturnWorkspaceOutputs', 'on');
  [plan, folder] = make_plan(model);
  cleanup = onCleanup(@() remove_charts(folder));

  span = [number(settings, 'StartTime'), number(settings, 'StopTime')];
  check_widths(model, plan, evaluate(plan, span(1), plan.start));
  derivative = @(t, state) state_derivative(model, plan, t, evaluate(plan, t, state));
  [time, states] = ode45(derivative, span, plan.start, solver_options(settings, span));
  output = log_signals(model, plan, time, states);
end

function [plan, folder] = make_plan(model)
% what an evaluation of the diagram needs, worked out once
  plan.wires = wire(model);
  plan.order = sort_blocks(model, plan.wires);
  [plan.start, plan.slots] = initial_state(model);
  [plan.functions, folder] = compile_charts(model);
  plan.outputs = arrayfun(@(block) nthargout(2, @simulink_ports, block), model.blocks);
  plan.order = plan.order(plan.outputs(plan.order) > 0);
end

function require(settings, name, value)
  if ~strcmp(settings.(name), value)
    error('Simulink:Engine:NotModelled', ...
          'this stand-in for Simulink knows %s = ''%s'' alone, not ''%s''\n', name, value, settings.(name));
  end
end

function value = number(settings, name)
  value = str2double(settings.(name));
  if isnan(value)
    error('Simulink:Engine:NotModelled', ...
          'this stand-in for Simulink needs a number for %s, not ''%s''\n', name, settings.(name));
  end
end

function options = solver_options(settings, span)
  if strcmp(settings.MaxStep, 'auto')
    settings.MaxStep = mat2str(diff(span) / 50);  % as documented for a variable-step solver
  end
  options = odeset('RelTol', number(settings, 'RelTol'), 'AbsTol', number(settings, 'AbsTol'), ...
                   'MaxStep', number(settings, 'MaxStep'), 'Refine', number(settings, 'Refine'));
end

function wires = wire(model)
% wires{k} has one row [block, output port] per input port of block k
  wires = cell(1, numel(model.blocks));
  for k = 1:numel(model.blocks)
    [inputs, ~] = simulink_ports(model.blocks(k));
    wires{k} = zeros(inputs, 2);
    for port = 1:inputs
      line = model.lines([model.lines.to] == k & [model.lines.in] == port);
      if isempty(line)
        error('Simulink:Engine:InputNotConnected', ...
              'input port %d of block ''%s/%s'' is not connected\n', port, model.name, model.blocks(k).name);
      end
      [~, outputs] = simulink_ports(model.blocks(line.from));
      if line.out > outputs
        error('Simulink:Engine:InvalidPort', ...
              'block ''%s/%s'' has no output port %d\n', model.name, model.blocks(line.from).name, line.out);
      end
      wires{k}(port, :) = [line.from, line.out];
    end
  end
end

function order = sort_blocks(model, wires)
% a block with direct feedthrough comes after the blocks that feed it
  order = [];
  waiting = 1:numel(model.blocks);
  while ~isempty(waiting)
    ready = waiting(arrayfun(@(k) ~feedthrough(model, k) || ~any(ismember(wires{k}(:, 1), waiting)), waiting));
    if isempty(ready)
      error('Simulink:Engine:BlkInAlgLoop', 'algebraic loop through %s\n', ...
            strjoin(arrayfun(@(k) ['''' model.name '/' model.blocks(k).name ''''], waiting, 'UniformOutput', false), ', '));
    end
    order = [order, ready];
    waiting = setdiff(waiting, ready);
  end
end

function direct = feedthrough(model, k)
  direct = simulink_library(model.blocks(k).source).feedthrough;
end

function [functions, folder] = compile_charts(model)
% each Script becomes a function file of its own, under a name of its own
  folder = tempname();
  mkdir(folder);
  functions = cell(1, numel(model.blocks));
  for k = find(~cellfun(@isempty, {model.blocks.chart}))
    [~, ~, name] = simulink_ports(model.blocks(k));
    [~, unique] = fileparts(tempname());
    unique = ['chart_' regexprep(unique, '\W', '_')];
    file = fopen(fullfile(folder, [unique '.m']), 'w');
    fputs(file, regexprep(model.blocks(k).chart.Script, ['\<' name '\>'], unique, 'once'));
    fclose(file);
    functions{k} = unique;
  end
  addpath(folder);
  functions = cellfun(@to_handle, functions, 'UniformOutput', false);
end

function handle = to_handle(name)
  handle = name;
  if ~isempty(name)
    handle = str2func(name);
  end
end

function remove_charts(folder)
  rmpath(folder);
  confirm_recursive_rmdir(false, 'local');
  rmdir(folder, 's');
end

function [start, slots] = initial_state(model)
% the states of the Integrators, one after another; slots{k} are those of block k
  start = [];
  slots = cell(1, numel(model.blocks));
  for k = 1:numel(model.blocks)
    if isfield(model.blocks(k).parameters, 'InitialCondition')
      value = str2num(model.blocks(k).parameters.InitialCondition);
      if isempty(value) || ~isvector(value)
        error('Simulink:blocks:InitialCondition', 'block ''%s/%s'': InitialCondition ''%s'' is not a vector\n', ...
              model.name, model.blocks(k).name, model.blocks(k).parameters.InitialCondition);
      end
      slots{k} = numel(start) + (1:numel(value));
      start = [start; value(:)];
    end
  end
end

function signals = evaluate(plan, t, state)
% signals{k}{port}, the outputs of every block at one instant
  signals = cell(1, numel(plan.outputs));
  for k = plan.order
    wires = plan.wires{k};
    if ~isempty(plan.functions{k})
      inputs = cell(1, size(wires, 1));
      for port = 1:numel(inputs)
        inputs{port} = signals{wires(port, 1)}{wires(port, 2)};
      end
      values = cell(1, plan.outputs(k));
      [values{:}] = plan.functions{k}(inputs{:});
      signals{k} = values;
    elseif ~isempty(plan.slots{k})
      signals{k} = {state(plan.slots{k})};
    else
      signals{k} = {t};  % Clock
    end
  end
end

function check_widths(model, plan, signals)
  for k = find(~cellfun(@isempty, plan.slots))
    width = numel(signals{plan.wires{k}(1)}{plan.wires{k}(2)});
    if width ~= numel(plan.slots{k})
      error('Simulink:Engine:PortDimsMismatch', ...
            'input port 1 of block ''%s/%s'' has width %d, its InitialCondition %d\n', ...
            model.name, model.blocks(k).name, width, numel(plan.slots{k}));
    end
  end
end

function slope = state_derivative(model, plan, t, signals)
  slope = zeros(size(plan.start));
  for k = 1:numel(plan.slots)
    if ~isempty(plan.slots{k})
      slope(plan.slots{k}) = signals{plan.wires{k}(1)}{plan.wires{k}(2)};
      if ~all(isfinite(slope(plan.slots{k})))
        error('Simulink:Engine:DerivNotFinite', ...
              'the derivative of the state of block ''%s/%s'' is not finite at t = %g\n', model.name, model.blocks(k).name, t);
      end
    end
  end
end

function output = log_signals(model, plan, time, states)
% what each To Workspace block saves, one sample per step of the solver
  output = struct();
  sinks = find(strcmp({model.blocks.source}, 'simulink/Sinks/To Workspace'));
  logged = cell(numel(time), numel(sinks));
  for i = 1:numel(time)
    signals = evaluate(plan, time(i), states(i, :)');
    for j = 1:numel(sinks)
      from = plan.wires{sinks(j)};
      logged{i, j} = signals{from(1)}{from(2)};
    end
  end
  for j = 1:numel(sinks)
    output = save_signal(output, model, model.blocks(sinks(j)), time, logged(:, j));
  end
end

function output = save_signal(output, model, block, time, samples)
  name = block.parameters.VariableName;
  if isfield(output, name)
    error('Simulink:blocks:ToWorkspaceName', ...
          'block ''%s/%s'': another block already logs to ''%s''\n', model.name, block.name, name);
  end
  most = str2double(block.parameters.MaxDataPoints);
  if isnan(most)
    error('Simulink:blocks:ToWorkspaceLimit', 'block ''%s/%s'': MaxDataPoints ''%s'' is no number\n', ...
          model.name, block.name, block.parameters.MaxDataPoints);
  end
  kept = max(1, numel(samples) - most + 1):numel(samples);
  [time, samples] = deal(time(kept), samples(kept));
  if isscalar(samples{1})
    values = vertcat(samples{:});
  else
    values = cat(3, samples{:});  % a column is a 2-D signal: one page per sample
  end
  switch block.parameters.SaveFormat
    case 'Array'
      output.(name) = values;
    case {'Structure', 'Structure With Time'}
      signals = struct('values', values, 'dimensions', size(samples{1}), 'label', '');
      output.(name) = struct('time', [], 'signals', signals, 'blockName', [model.name '/' block.name]);
      if strcmp(block.parameters.SaveFormat, 'Structure With Time')
        output.(name).time = time;
      end
    otherwise
      error('Simulink:blocks:ToWorkspaceFormat', 'block ''%s/%s'': SaveFormat ''%s'' is not known here\n', ...
            model.name, block.name, block.parameters.SaveFormat);
  end
end
