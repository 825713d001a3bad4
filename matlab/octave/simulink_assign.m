function parameters = simulink_assign(parameters, owner, pairs)
%simulink_assign  Set parameters from name-value pairs; a name that the owner lacks is an error.
% SPDX-License-Identifier: MIT
  if mod(numel(pairs), 2) ~= 0
    error('Simulink:Commands:ParamPairs', '%s: parameters come in pairs of a name and a value\n', owner);
  end
  for k = 1:2:numel(pairs)
    [name, value] = pairs{k:k + 1};
    if ~isfield(parameters, name)
      error('Simulink:Commands:ParamUnknown', '%s does not have a parameter named ''%s''\n', owner, name);
    end
    if ~strcmp(name, 'Position') && ~ischar(value)
      error('Simulink:Commands:ParamType', '%s: the value of ''%s'' must be text\n', owner, name);
    end
    parameters.(name) = value;
  end
end
