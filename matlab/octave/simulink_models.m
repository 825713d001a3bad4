function model = simulink_models(action, name, model)
%simulink_models  The models in memory, by name.
%   simulink_models('has', name), simulink_models('get', name), simulink_models('put', name, model),
%   simulink_models('drop', name) and simulink_models('names', '').  A model is a struct: name; parameters (struct of char); blocks (struct array:
%   name, source, parameters, chart); lines (struct array: from, out, to, in, with block indices and port numbers).
% SPDX-License-Identifier: MIT
  persistent models = struct();
  known = isfield(models, name);
  if ~known && ~any(strcmp(action, {'has', 'put', 'names'}))
    error('Simulink:Commands:InvSimulinkObjectName', 'there is no model named ''%s'' in memory\n', name);
  end
  switch action
    case 'has'
      model = known;
    case 'get'
      model = models.(name);
    case 'put'
      models.(name) = model;
    case 'names'
      model = fieldnames(models)';
    case 'drop'
      models = rmfield(models, name);
  end
end
