function set_param(path, varargin)
%set_param  Set parameters of a model ('model') or of a block ('model/Name').
% SPDX-License-Identifier: MIT
  [name, block] = simulink_path(path);
  model = simulink_models('get', name);
  if isempty(block)
    model.parameters = simulink_assign(model.parameters, ['model ''' name ''''], varargin);
  else
    k = simulink_block_index(model, block);
    model.blocks(k).parameters = simulink_assign(model.blocks(k).parameters, ['block ''' path ''''], varargin);
  end
  simulink_models('put', name, model);
end
