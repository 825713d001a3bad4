function [inputs, outputs, name] = simulink_ports(block)
%simulink_ports  The numbers of input and output ports of a block, and the function name of a MATLAB Function block.
% SPDX-License-Identifier: MIT
  entry = simulink_library(block.source);
  [inputs, outputs, name] = deal(entry.inputs, entry.outputs, '');
  if isempty(block.chart)
    return
  end
  signature = '^\s*function\s+(?:\[?([\w\s,]*)\]?\s*=)?\s*(\w+)\s*\(([\w\s,]*)\)';
  parts = regexp(block.chart.Script, signature, 'tokens', 'once');
  if isempty(parts)
    error('Stateflow:MALformed:Script', ...
          'MATLAB Function block ''%s'': its Script must begin with a line ''function [outputs] = name(inputs)''\n', block.name);
  end
  outputs = numel(regexp(parts{1}, '\w+', 'match'));
  name = parts{2};
  inputs = numel(regexp(parts{3}, '\w+', 'match'));
end
