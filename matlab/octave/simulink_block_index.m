function index = simulink_block_index(model, name)
%simulink_block_index  Where the block of that name stands in model.blocks; an unknown name is an error.
% SPDX-License-Identifier: MIT
  index = find(strcmp({model.blocks.name}, name));
  if isempty(index)
    error('Simulink:Commands:InvSimulinkObjectName', 'there is no block ''%s/%s''\n', model.name, name);
  end
end
