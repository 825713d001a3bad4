function [model, block] = simulink_path(path)
%simulink_path  Split 'model/Block Name' into the model and the block; block is '' for a model's own path.
% SPDX-License-Identifier: MIT
  parts = strsplit(path, '/');
  if numel(parts) > 2
    error('Simulink:Commands:Subsystem', '''%s'': this stand-in for Simulink has no subsystems\n', path);
  end
  model = parts{1};
  block = strjoin(parts(2:end), '/');
end
