function handle = yline(value, style, varargin)
%yline  A horizontal line across the current axes, as MATLAB's: yline(value, '--', property, value, ...).
% SPDX-License-Identifier: MIT
  handle = line(xlim(), [value, value], 'LineStyle', style, 'Color', [0.15, 0.15, 0.15], varargin{:});
end
