function value = get_param(path, name)
%get_param  A parameter of a model or of a block, or the model's object: get_param('model', 'Object').
% SPDX-License-Identifier: MIT
  [parent, block] = simulink_path(path);
  model = simulink_models('get', parent);
  if isempty(block) && strcmp(name, 'Object')
    value = SimulinkModel(parent);
    return
  end
  parameters = model.parameters;
  if ~isempty(block)
    parameters = model.blocks(simulink_block_index(model, block)).parameters;
  end
  if ~isfield(parameters, name)
    error('Simulink:Commands:ParamUnknown', '''%s'' does not have a parameter named ''%s''\n', path, name);
  end
  value = parameters.(name);
end
