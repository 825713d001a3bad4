function add_block(source, destination, varargin)
%add_block  Add a library block to a model: add_block('simulink/...', 'model/Name', parameter, value, ...).
% SPDX-License-Identifier: MIT
  entry = simulink_library(source);
  [parent, name] = simulink_path(destination);
  model = simulink_models('get', parent);
  if any(strcmp({model.blocks.name}, name))
    error('Simulink:Commands:AddBlockExists', 'there is already a block ''%s''\n', destination);
  end
  chart = [];
  if strcmp(source, 'simulink/User-Defined Functions/MATLAB Function')
    chart = EMChart(destination);
  end
  parameters = simulink_assign(entry.parameters, ['block ''' destination ''''], varargin);
  model.blocks(end + 1) = struct('name', name, 'source', source, 'parameters', parameters, 'chart', {chart});
  simulink_models('put', parent, model);
end
