classdef SimulinkModel < handle
%SimulinkModel  What get_param(model, 'Object') is: find(object, '-isa', 'Stateflow.EMChart', 'Path', path) finds code.
% SPDX-License-Identifier: MIT
  properties
    Name = '';
  end
  methods
    function object = SimulinkModel(name)
      object.Name = name;
    end
    function chart = find(object, varargin)
      if numel(varargin) ~= 4 || ~isequal(varargin(1:3), {'-isa', 'Stateflow.EMChart', 'Path'})
        error('Stateflow:find', 'find: only (''-isa'', ''Stateflow.EMChart'', ''Path'', path) is known here\n');
      end
      [name, block] = simulink_path(varargin{4});
      if ~strcmp(name, object.Name)
        error('Stateflow:find', 'model ''%s'' has no block ''%s''\n', object.Name, varargin{4});
      end
      model = simulink_models('get', name);
      chart = model.blocks(simulink_block_index(model, block)).chart;
      if isempty(chart)
        error('Stateflow:find', 'block ''%s'' is not a MATLAB Function block\n', varargin{4});
      end
    end
  end
end
