function add_line(name, from, to, varargin)
%add_line  Connect 'Block/output port' to 'Block/input port' in a model.
% SPDX-License-Identifier: MIT
  model = simulink_models('get', name);
  if ~isempty(varargin)
    simulink_assign(struct('autorouting', 'off'), 'add_line', varargin);
  end
  [source, out] = endpoint(model, from);
  [destination, in] = endpoint(model, to);
  [~, outputs] = simulink_ports(model.blocks(source));
  inputs = simulink_ports(model.blocks(destination));
  check_port(name, from, out, outputs, 'output');
  check_port(name, to, in, inputs, 'input');
  if any([model.lines.to] == destination & [model.lines.in] == in)
    error('Simulink:Commands:AddLineDstAlreadyConnected', ...
          'input port %d of block ''%s/%s'' already has a line\n', in, name, model.blocks(destination).name);
  end
  model.lines(end + 1) = struct('from', source, 'out', out, 'to', destination, 'in', in);
  simulink_models('put', name, model);
end

function [index, port] = endpoint(model, text)
  parts = regexp(text, '^(.*)/(\d+)$', 'tokens', 'once');
  if isempty(parts)
    error('Simulink:Commands:AddLineEndpoint', '''%s'': an end of a line is written ''Block/port number''\n', text);
  end
  index = simulink_block_index(model, parts{1});
  port = str2double(parts{2});
end

function check_port(model, text, port, ports, kind)
  if port < 1 || port > ports
    error('Simulink:Commands:AddLinePort', 'there is no %s port ''%s/%s'': the block has %d\n', kind, model, text, ports);
  end
end
