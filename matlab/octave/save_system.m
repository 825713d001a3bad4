function save_system(name, file)
%save_system  Write the diagram as JSON and as a picture (SVG) beside where Simulink would write its .slx file.
%   save_system('model', 'model.slx') writes model.json and model.svg: this stand-in cannot make a real .slx.
% SPDX-License-Identifier: MIT
  model = simulink_models('get', name);
  [folder, stem] = fileparts(file);
  write_text(fullfile(folder, [stem '.json']), [jsonencode(description(model)), newline]);
  write_text(fullfile(folder, [stem '.svg']), picture(model));
end

function write_text(path, text)
  file = fopen(path, 'w');
  if file < 0
    error('Simulink:Commands:SaveSysWrite', 'cannot write %s\n', path);
  end
  fputs(file, text);
  fclose(file);
end

function data = description(model)
  names = {model.blocks.name};
  data = struct('model', model.name, 'parameters', model.parameters);
  data.blocks = cell(1, numel(names));
  for k = 1:numel(names)
    data.blocks{k} = struct('name', names{k}, 'source', model.blocks(k).source, 'parameters', model.blocks(k).parameters);
    if ~isempty(model.blocks(k).chart)
      data.blocks{k}.script = model.blocks(k).chart.Script;
    end
  end
  data.lines = cell(1, numel(model.lines));
  for k = 1:numel(model.lines)
    line = model.lines(k);
    data.lines{k} = struct('from', sprintf('%s/%d', names{line.from}, line.out), ...
                           'to', sprintf('%s/%d', names{line.to}, line.in));
  end
end

function text = picture(model)
  positions = vertcat(cellfun(@(p) p.Position, {model.blocks.parameters}, 'UniformOutput', false){:});
  extent = [max(positions(:, 3)) + 40, max(positions(:, 4)) + 70];
  text = sprintf(['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %g %g" width="%g" height="%g" role="img">\n' ...
                  '<title>%s</title>\n<defs><marker id="arrow" markerWidth="8" markerHeight="8" refX="7" refY="4" ' ...
                  'orient="auto"><path d="M0,0 L8,4 L0,8 z"/></marker></defs>\n' ...
                  '<rect width="100%%" height="100%%" fill="white"/>\n'], extent, extent, model.name);
  text = [text '<g fill="none" stroke="black" marker-end="url(#arrow)">' newline];
  for k = 1:numel(model.lines)
    points = route(model, model.lines(k), k);
    text = [text sprintf('<polyline points="%s" marker-end="url(#arrow)"/>\n', sprintf('%g,%g ', points'))];
  end
  text = [text '</g>' newline '<g font-family="sans-serif" font-size="11" text-anchor="middle">' newline];
  for k = 1:numel(model.blocks)
    p = positions(k, :);
    text = [text sprintf(['<rect x="%g" y="%g" width="%g" height="%g" fill="white" stroke="black"/>' ...
                          '<text x="%g" y="%g">%s</text>\n'], p(1:2), p(3:4) - p(1:2), ...
                         mean(p([1, 3])), p(4) + 14, model.blocks(k).name)];
    text = [text sprintf('<text x="%g" y="%g">%s</text>\n', mean(p([1, 3])), mean(p([2, 4])) + 4, face(model.blocks(k)))];
  end
  text = [text '</g>' newline '</svg>' newline];
end

function points = route(model, line, k)
  [~, outputs] = simulink_ports(model.blocks(line.from));
  inputs = simulink_ports(model.blocks(line.to));
  p = model.blocks(line.from).parameters.Position;
  q = model.blocks(line.to).parameters.Position;
  a = [p(3), p(2) + (p(4) - p(2)) * (line.out - 0.5) / outputs];
  b = [q(1), q(2) + (q(4) - q(2)) * (line.in - 0.5) / inputs];
  if a(1) < b(1)
    middle = mean([a(1), b(1)]);
    points = [a; middle, a(2); middle, b(2); b];
  else  % back to the left, below the blocks
    below = max(arrayfun(@(block) block.parameters.Position(4), model.blocks)) + 30;
    points = [a; a(1) + 20, a(2); a(1) + 20, below; b(1) - 20, below; b(1) - 20, b(2); b];
  end
end

function text = face(block)
  switch block.source
    case 'simulink/Continuous/Integrator'
      text = '1/s';
    case 'simulink/Sinks/To Workspace'
      text = block.parameters.VariableName;
    case 'simulink/Sources/Clock'
      text = 't';
    otherwise
      [~, ~, text] = simulink_ports(block);
  end
end
