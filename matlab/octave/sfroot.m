classdef sfroot < handle
%sfroot  The root of the Stateflow objects: root = sfroot(); root.find('-isa', 'Stateflow.EMChart', 'Path', path).
% SPDX-License-Identifier: MIT
  methods
    function chart = find(root, varargin)
      if numel(varargin) ~= 4 || ~isequal(varargin(1:3), {'-isa', 'Stateflow.EMChart', 'Path'})
        error('Stateflow:find', 'find: only (''-isa'', ''Stateflow.EMChart'', ''Path'', path) is known here\n');
      end
      [name, block] = simulink_path(varargin{4});
      model = simulink_models('get', name);
      chart = model.blocks(simulink_block_index(model, block)).chart;
      if isempty(chart)
        error('Stateflow:find', 'block ''%s'' is not a MATLAB Function block\n', varargin{4});
      end
    end
  end
end
